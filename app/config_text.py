"""Settings as the TOML file that `flinch run --params FILE` takes."""

from collections.abc import Iterator

from app.config import Params, Tunable, tunables


def toml(params: Params) -> Iterator[str]:
    """The lines of a file with every setting, each with its range and what it is."""
    group = ""
    for t in tunables():
        if t.group != group:
            group = t.group
            yield f"# --- {group.lower()} ---"
        value = getattr(params, t.name)
        written = f'"{value}"' if t.choices else str(value).lower()
        yield f"{t.name} = {written}  # {range_words(t)}{t.help}"


def range_words(t: Tunable) -> str:
    """Its unit and range, or what may be chosen, with a colon; empty for a switch."""
    if t.choices:
        return f"{', '.join(t.choices)}: "
    return f"{t.low:g} to {t.high:g} {t.unit}".rstrip() + ": " if t.low is not None else ""
