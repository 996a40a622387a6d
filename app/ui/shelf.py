"""Small TOML files that a page saves and loads again: settings, scenes.

Their folder is the starter's choice and their names are the clock's: a page has no say in a path.
What is asked here waits for the disk, so it is not asked on the thread of the sockets.
"""

from datetime import UTC, datetime
from pathlib import Path

from app.errors import ConfigError
from app.timing import date_now

MOST = 50  # files that are listed, the newest first


class Shelf:
    """Files `KIND_DATE.toml` in one folder."""

    def __init__(self, folder: Path, kind: str) -> None:
        self.folder, self._kind = folder, kind

    def names(self) -> tuple[str, ...]:
        """Names of the files that are there, the newest first."""
        found = (p.name for p in self.folder.glob(f"{self._kind}_*.toml"))
        return tuple(sorted(found, reverse=True)[:MOST])

    def save(self, text: str) -> Path:
        """A new file with this text. ConfigError where it cannot be written."""
        when = datetime.fromtimestamp(date_now(), UTC).strftime("%Y-%m-%d_%H-%M-%SZ")
        path = self.folder / f"{self._kind}_{when}.toml"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        except OSError as e:
            raise ConfigError(f"{path}: cannot be written ({e.strerror})") from e
        return path

    def path(self, name: str) -> Path:
        """The file of one of `names`; ConfigError for any other name."""
        if name not in self.names():
            raise ConfigError(f"{name!r} is none of the saved files; choose one of the list")
        return self.folder / name
