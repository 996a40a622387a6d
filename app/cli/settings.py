"""`flinch settings`: every setting with its default, as a file to edit or as the manual's table."""

from collections.abc import Iterator
from dataclasses import dataclass

from app.config import Tunable, tunables
from app.control.registry import kinds


@dataclass(frozen=True)
class Settings:
    """Print every setting with its default: a TOML file to edit and give to run --config."""

    markdown: bool = False
    """Print the table of the manual instead."""

    def __call__(self) -> None:
        kinds()  # the controllers name themselves to the settings
        print("\n".join(markdown() if self.markdown else toml()))


def toml() -> Iterator[str]:
    """The lines of a settings file that changes nothing."""
    group = ""
    for t in tunables():
        if t.group != group:
            group = t.group
            yield f"# --- {group.lower()} ---"
        value = f'"{t.default}"' if t.choices else str(t.default).lower()
        yield f"{t.name} = {value}  # {_range(t)}{t.help}"


def markdown() -> Iterator[str]:
    """The lines of the manual's table."""
    yield "| on the page | flag and key | default | range | what it is |"
    yield "|---|---|---|---|---|"
    for t in tunables():
        default = t.default if t.choices else str(t.default).lower()
        flag = t.name.replace("_", "-")
        yield f"| {t.label} | `--{flag}` | {default} | {_range(t).rstrip(': ')} | {t.about} |"


def _range(t: Tunable) -> str:
    """Its unit and range, or what may be chosen, with a colon; empty for a switch."""
    if t.choices:
        return f"{', '.join(t.choices)}: "
    return f"{t.low:g} to {t.high:g} {t.unit}".rstrip() + ": " if t.low is not None else ""
