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
    fault: str


T = TypeVar("T", bound=Logged)
BEGINNING = '{"settings": '  # of each line


class TrialLog(Generic[T]):
    """Appends each trial as it is done, and knows those of the same settings done before."""

    def __init__(
        self, path: Path | None, settings: dict[str, float | str], kind: Callable[..., T],
        beside: Iterable[Path] = (),
    ) -> None:  # fmt: skip
        """Only in the memory without a `path`; ConfigError for a file that is no such log.

        kind: the class of its trials. A last line that was torn, since its writer was killed,
        is run again, and cut off when the next trial is added.
        beside: logs of others, which are only read; their last line may be just being written.
        A trial that was run again after a fault is what it was when it went well."""
        self._path, self._settings, self._kind = path, settings, kind
        self._whole: int | None = None  # bytes before a torn line
        self.done: dict[tuple[int, str], T] = {}
        for other in beside:
            self._read(other)
        if path is not None:
            self._whole = self._read(path)

    def _read(self, path: Path) -> int | None:
        """Know the trials of a file; gives the bytes before a torn last line."""
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
        except (OSError, UnicodeDecodeError) as e:
            raise ConfigError(f"{path}: cannot be read ({e}); give another file") from e
        whole, newline, torn = text.rpartition("\n")
        end = None
        if torn and (whole or torn.startswith(BEGINNING) or BEGINNING.startswith(torn)):
            text, end = whole, len((whole + newline).encode())
        for number, line in enumerate(text.splitlines(), 1):
            try:
                entry = json.loads(line)
                known, trial = entry["settings"], self._kind(**entry["trial"])
            except (ValueError, KeyError, TypeError) as e:
                raise ConfigError(
                    f"{path}, line {number}: not a trial; remove it or give another file"
                ) from e
            if known != self._settings:
                raise ConfigError(
                    f"{path}, line {number}: made with {known}, not {self._settings}; "
                    "give another file"
                )
            if not trial.fault or (trial.seed, trial.mode) not in self.done:
                self.done[trial.seed, trial.mode] = trial
        return end

    def add(self, trial: T) -> None:
        """Note a trial that is done."""
        self.done[trial.seed, trial.mode] = trial
        if self._path is None:
            return
        entry = {"settings": self._settings, "trial": asdict(cast(Any, trial))}
        line = (json.dumps(entry) + "\n").encode()
        try:
            if self._whole is not None:
                os.truncate(self._path, self._whole)
                self._whole = None
            with self._path.open("ab", buffering=0) as f:  # in one go: whoever reads meanwhile
                f.write(line)  # finds it whole or not at all
        except OSError as e:
            raise ConfigError(f"{self._path}: cannot be written ({e}); give another file") from e

    def missing(self, wanted: Iterable[tuple[int, str]]) -> list[tuple[int, str]]:
        """Those of the wanted (seed, mode) that are not done."""
        return [w for w in wanted if w not in self.done]
