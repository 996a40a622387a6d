"""Trials on disk, one JSON object a line, so that hours of them survive a stop."""

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, cast

from app.errors import ConfigError


class Logged(Protocol):
    """A dataclass of what JSON knows: what was done in the world of a seed, by what."""

    seed: int
    mode: str


T = TypeVar("T", bound=Logged)


class TrialLog(Generic[T]):
    """Appends each trial as it is done, and knows those of the same settings done before."""

    def __init__(
        self, path: Path | None, settings: dict[str, float | str], kind: Callable[..., T]
    ) -> None:
        """Only in the memory without a `path`; ConfigError for a file that is no such log.

        kind: the class of its trials. A last line that was torn, since its writer was killed,
        is run again, and cut off when the next trial is added."""
        self._path, self._settings = path, settings
        self._whole: int | None = None  # bytes before a torn line
        self.done: dict[tuple[int, str], T] = {}
        if path is None:
            return
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
        except (OSError, UnicodeDecodeError) as e:
            raise ConfigError(f"{path}: cannot be read ({e}); give another file") from e
        whole, newline, torn = text.rpartition("\n")
        if whole and torn:
            text, self._whole = whole, len((whole + newline).encode())
        for number, line in enumerate(text.splitlines(), 1):
            try:
                entry = json.loads(line)
                known, trial = entry["settings"], kind(**entry["trial"])
            except (ValueError, KeyError, TypeError) as e:
                raise ConfigError(
                    f"{path}, line {number}: not a trial; remove it or give another file"
                ) from e
            if known != settings:
                raise ConfigError(
                    f"{path}, line {number}: made with {known}, not {settings}; give another file"
                )
            self.done[trial.seed, trial.mode] = trial

    def add(self, trial: T) -> None:
        """Note a trial that is done."""
        self.done[trial.seed, trial.mode] = trial
        if self._path is None:
            return
        entry = {"settings": self._settings, "trial": asdict(cast(Any, trial))}
        try:
            if self._whole is not None:
                os.truncate(self._path, self._whole)
                self._whole = None
            with self._path.open("a", encoding="utf-8") as f:
                f.write(json.dumps(entry) + "\n")
        except OSError as e:
            raise ConfigError(f"{self._path}: cannot be written ({e}); give another file") from e

    def missing(self, wanted: Iterable[tuple[int, str]]) -> list[tuple[int, str]]:
        """Those of the wanted (seed, mode) that are not done."""
        return [w for w in wanted if w not in self.done]
