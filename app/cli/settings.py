"""`flinch settings`: every setting with its default, as a file to edit or as the manual's table."""

from collections.abc import Iterator
from dataclasses import dataclass

from app.config import Params, tunables
from app.config_text import range_words, toml
from app.control.registry import kinds


@dataclass(frozen=True)
class Settings:
    """Print every setting with its default: a TOML file to edit and give to run --params."""

    markdown: bool = False
    """Print the table of the manual instead."""

    def __call__(self) -> None:
        kinds()  # the controllers name themselves to the settings
        print("\n".join(markdown() if self.markdown else toml(Params())))


def markdown() -> Iterator[str]:
    """The lines of the manual's table."""
    yield "| on the page | flag and key | default | range | what it is |"
    yield "|---|---|---|---|---|"
    for t in tunables():
        default = t.default if t.choices else str(t.default).lower()
        flag = t.name.replace("_", "-")
        yield f"| {t.label} | `--{flag}` | {default} | {range_words(t).rstrip(': ')} | {t.about} |"
