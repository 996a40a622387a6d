"""All trials of the benchmark: those that are missing are run, those that are known are not."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.control.guests.files import guest_digest, is_guest
from app.studies.benchmark.attempt import attempted
from app.studies.benchmark.listing import Benchmark, SetTable, Slot, short_name
from app.studies.study import Run
from app.studies.trial import TrialResult, TrialSpec
from app.studies.trial_log import TrialLog

Key = tuple[str, str, int]  # experiment, condition, seed


@dataclass(frozen=True)
class Outcome:
    """What came of a controller in a set."""

    set: str
    controller: str
    trials: dict[Slot, TrialResult]

    @property
    def good(self) -> dict[Slot, TrialResult]:
        """Those that did not die, with people there."""
        return {k: t for k, t in self.trials.items() if not t.fault and not k.alone}


def run_benchmark(
    bench: Benchmark, controllers: Sequence[str], run: Run, folder: Path | None = None,
    progress: Callable[[TrialResult, int, int], None] = lambda result, done, wanted: None,
) -> list[Outcome]:  # fmt: skip
    """Every controller in every set.

    folder: keeps the trials, a file for each controller in each set; a guest whose file has
    changed is tried anew.   progress: is told of each trial that is done, how many are, of how
    many.
    """
    bench.check(controllers)
    wanted, logs = {}, dict[Key, TrialLog[TrialResult]]()
    for s in bench.sets:
        for controller in controllers:
            specs = bench.specs(s, controller)
            wanted[s.name, controller] = specs
            log = TrialLog(_file(folder, s, controller), _settings(bench, s), TrialResult)
            logs |= {_key(spec): log for spec in specs.values()}
    every = {_key(spec): spec for specs in wanted.values() for spec in specs.values()}
    missing = [spec for key, spec in every.items() if key[:0:-1] not in logs[key].done]
    done = len(every) - len(missing)
    for spec, result in run(attempted, missing) if missing else ():
        logs[_key(spec)].add(result)
        done += 1
        progress(result, done, len(every))
    return [
        Outcome(name, controller, {k: _of(logs, spec) for k, spec in specs.items()})
        for (name, controller), specs in wanted.items()
    ]


def _of(logs: dict[Key, TrialLog[TrialResult]], spec: TrialSpec) -> TrialResult:
    return logs[_key(spec)].done[spec.seed, spec.condition]


def _key(spec: TrialSpec) -> Key:
    return spec.experiment, spec.condition, spec.seed


def _settings(bench: Benchmark, s: SetTable) -> dict[str, float | str]:
    """What trials of a file must have in common."""
    return {"list": bench.digest, "set": s.name, "seconds": bench.seconds(s)}


def _file(folder: Path | None, s: SetTable, controller: str) -> Path | None:
    if folder is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{slug(s.name)}--{file_name(controller)}.jsonl"


def file_name(controller: str) -> str:
    """Of what belongs to a controller; another one for a guest that has changed."""
    if not is_guest(controller):
        return slug(controller)
    return f"{slug(short_name(controller))}-{guest_digest(controller)}"


def slug(name: str) -> str:
    """A name as a file's."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
