"""All that comes of a study, in one folder; several shards may write into the same one.

study.json             what was tried, with which versions
trials.jsonl           each trial as it was done; of a shard: trials-2of4.jsonl
trials.csv             a row a trial with all of its figures: the same bytes for the same seeds
table.csv, table.json  what is told of them
"""

import csv
import fcntl
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.errors import ConfigError
from app.report import Report, versions
from app.studies.pool import parts_of
from app.studies.study import Part, Study
from app.studies.trial import TrialResult

KEYS = ("condition", "seed", "fault")


class Folder:
    """The folder of a study."""

    def __init__(self, path: Path) -> None:
        """Made where there is none; ConfigError where it cannot be."""
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise ConfigError(f"{path}: no folder ({e.strerror}); give another") from e

    def part(self, study: Study, shard: str = "1/1") -> Part:
        """The study with its log, and what all other shards have done so far."""
        own = self._log(shard)
        others = [p for p in sorted(self.path.glob("trials*.jsonl")) if p != own]
        return Part(study, study.log(own, others))

    @contextmanager
    def writing(self, shard: str = "1/1") -> Iterator[None]:
        """While this lasts no other process runs this shard into this folder."""
        path = self._log(shard)
        with _opened(path) as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as e:
                raise ConfigError(
                    f"{path}: another run writes it; wait for it, or give another --shard or --out"
                ) from e
            yield

    def begin(self, study: Study) -> None:
        """Say what is tried."""
        content = {
            "study": asdict(study), "settings": study.settings, "versions": versions(),
            "conditions": list(dict.fromkeys(s.condition for s in study.specs())),
        }  # fmt: skip
        replace(self.path / "study.json", json.dumps(content, indent=2) + "\n")

    def write(self, study: Study, results: Sequence[TrialResult], report: Report) -> None:
        """The tables, each replaced as a whole."""
        replace(self.path / "trials.csv", table(trial_rows(study, results), KEYS))
        replace(self.path / "table.csv", table(report.rows, ("name",)))
        replace(self.path / "table.json", report.to_json() + "\n")

    def _log(self, shard: str) -> Path:
        number, of = parts_of(shard)
        return self.path / (f"trials-{number}of{of}.jsonl" if of > 1 else "trials.jsonl")


@contextmanager
def _opened(path: Path) -> Iterator[io.BufferedWriter]:
    try:
        file = path.open("ab")
    except OSError as e:
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); give another folder") from e
    with file:
        yield file


def trial_rows(study: Study, results: Sequence[TrialResult]) -> list[dict[str, Any]]:
    """One a trial, by condition and then seed; scalar figures only."""
    order = {c: i for i, c in enumerate(dict.fromkeys(s.condition for s in study.specs()))}
    rows = []
    for r in sorted(results, key=lambda r: (order[r.condition], r.seed)):
        figures = {k: v for k, v in r.figures.items() if not isinstance(v, dict | list | tuple)}
        rows.append({"condition": r.condition, "seed": r.seed, **figures, "fault": r.fault})
    return rows


def table(rows: Sequence[Mapping[str, Any]], first: Sequence[str]) -> str:
    """CSV of rows whose columns are those of any of them, in the order in which they appear."""
    columns = list(dict.fromkeys([*first, *(key for row in rows for key in row)]))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row.get(c, "")) for c in columns] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> str:
    if isinstance(value, dict | list | tuple):
        return json.dumps(value)
    return repr(float(value)) if isinstance(value, float) else str(value)


def replace(path: Path, text: str) -> None:
    """Write a file as a whole: a reader, or a stop, finds the old one or the new one."""
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(path)
    except OSError as e:
        beside.unlink(missing_ok=True)
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); make room there") from e
