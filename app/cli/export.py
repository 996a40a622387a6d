"""`flinch export`: recordings as one page to keep or to mail."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from app.errors import ConfigError


@dataclass(frozen=True)
class Export:
    """Recordings into one page: the scene to turn and to scrub, distances below, no server."""

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Recordings, then the page to write: RUN.mcap OUT.html; several recordings of one robot stand
    side by side and are played together."""
    begin: Annotated[float, tyro.conf.arg(name="from")] = 0.0
    """Show it from here on [s since the recording's beginning]."""
    end: Annotated[float, tyro.conf.arg(name="to")] = field(default=float("inf"))
    """Show it up to here [s since the recording's beginning]; at most 120 s in all."""
    ghost: str = ""
    """Another controller, by its mode, given the same frames: drawn where its command would bring
    the arm within half a second (an open loop: it never gets anywhere by itself)."""
    stride: int = 0
    """Show every so many ticks; 0: 20 pictures a second."""

    def __post_init__(self) -> None:
        if len(self.paths) < 2:
            raise ConfigError("give a recording and the page to write: RUN.mcap OUT.html")
        if self.paths[-1].suffix.lower() not in (".html", ".htm"):
            raise ConfigError(f"{self.paths[-1]}: the last name is the page to write, OUT.html")
        if not self.paths[-1].parent.is_dir():
            raise ConfigError(f"{self.paths[-1]}: no folder {self.paths[-1].parent}; make it first")

    def __call__(self) -> None:
        from app.control.registry import kind_of
        from app.ui.export.export import Part
        from app.ui.export.recorded import page_from

        part = Part(self.begin, self.end, self.stride)
        ghost = {"mode": kind_of(self.ghost, "ghost").name} if self.ghost else {}
        write(page_from(self.paths[:-1], part, ghost), self.paths[-1])


def write(page: str, path: Path) -> None:
    """Write a page and say where it is and how large; ConfigError where that cannot be."""
    try:
        path.write_text(page, "utf-8")
    except OSError as e:
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); try another place") from e
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, opens in any browser", flush=True)
