"""Settings as they are typed: NAME=VALUE."""

import tomllib
from collections.abc import Iterable
from typing import Any

from app.config import Params, change, tunables
from app.errors import ConfigError


def settings_of(typed: Iterable[str]) -> dict[str, Any]:
    """`distance_kept=0.3` as a name and a value of its kind; ConfigError for any other text."""
    kinds = {t.name: t for t in tunables()}
    changes: dict[str, Any] = {}
    for text in typed:
        name, equals, value = (part.strip() for part in text.partition("="))
        name = name.replace("-", "_")
        if not equals or not value:
            raise ConfigError(f"set = {text!r}; give NAME=VALUE, as in distance_kept=0.3")
        known = kinds.get(name)
        changes[name] = value if known is not None and known.choices else _value(text, value)
    change(Params(), changes)  # names and ranges
    return changes


def _value(text: str, value: str) -> Any:
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        raise ConfigError(f"set = {text!r}; give a number, true or false") from None
