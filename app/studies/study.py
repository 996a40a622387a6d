"""A study: which trials of an experiment are wanted, run where they are missing, and told of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from app.report import Check, Report
from app.studies.engines import LOST, Run
from app.studies.engines.local import locally
from app.studies.experiment import Experiment, experiment_of, run_spec
from app.studies.pool import shard_of
from app.studies.trial import TrialResult, TrialSpec
from app.studies.trial_log import TrialLog

__all__ = ["Part", "Progress", "Run", "Study", "locally", "run_parts", "run_study", "tell"]

DIED = "trials that died"
# Is told of each trial that is done: it, how many are, and how many there are.
Progress = Callable[[TrialResult, int, int], None]


@dataclass(frozen=True)
class Study:
    """What is tried; empty conditions, and numbers of None: the experiment's own."""

    experiment: str
    conditions: tuple[str, ...] = ()
    trials: int | None = None
    seconds: float | None = None
    seed: int = 0
    world: str = "honest"
    rate: float = 125.0
    skin: str = ""

    @property
    def settings(self) -> dict[str, float | str]:
        """What trials must have in common to stand in one file."""
        return {
            "experiment": self.experiment, "seconds": self._kind.seconds
            if self.seconds is None else self.seconds, "rate": self.rate, "world": self.world,
            "skin": self.skin,
        }  # fmt: skip

    @property
    def _kind(self) -> Experiment:
        return experiment_of(self.experiment)

    def specs(self) -> list[TrialSpec]:
        """Every trial that is wanted, in the order in which it is told of."""
        kind, s = self._kind, self.settings
        conditions = kind.wanted(self.conditions)
        for name in conditions:
            kind.check_condition(name)
        trials = kind.trials if self.trials is None else self.trials
        keys = [(c, self.seed) for c in kind.before(conditions)]
        keys += [(c, self.seed + i) for i in range(trials) for c in conditions]
        seconds = float(s["seconds"])
        return [
            TrialSpec(kind.name, c, seed, seconds, self.rate, self.world, self.skin)
            for c, seed in dict.fromkeys(keys)
        ]

    def log(self, path: Path | None = None, beside: Sequence[Path] = ()) -> TrialLog[TrialResult]:
        """The log of its trials; `beside`: those of other shards, which are only read."""
        return TrialLog(path, self.settings, TrialResult, beside)


class Part(NamedTuple):
    """A study and its log; several are run in one go."""

    study: Study
    log: TrialLog[TrialResult]

    def misses(self, spec: TrialSpec) -> bool:
        """Is it to be run: for the first time, or again since its machine failed it?"""
        known = self.log.done.get((spec.seed, spec.condition))
        return known is None or known.fault.startswith(LOST)

    def results(self) -> list[TrialResult]:
        """Of all that are wanted those that are done, by whichever shard, in their order."""
        keys = [(s.seed, s.condition) for s in self.study.specs()]
        return [self.log.done[key] for key in keys if key in self.log.done]


def run_study(
    study: Study, run: Run, log: Path | None = None, shard: str = "1/1",
    progress: Progress = lambda result, done, wanted: None,
) -> list[TrialResult]:  # fmt: skip
    """All wanted trials of the shard, in their order; those in `log` are not run again."""
    part = Part(study, study.log(log))
    run_parts([part], run, shard, progress)
    return part.results()


def run_parts(
    parts: Sequence[Part], run: Run, shard: str = "1/1",
    progress: Progress = lambda result, done, wanted: None,
) -> None:  # fmt: skip
    """Run the shard's trials of all studies that are not in their logs, and note them there."""
    mine = shard_of([(part, spec) for part in parts for spec in part.study.specs()], shard)
    missing = {spec: part for part, spec in mine if part.misses(spec)}
    done = len(mine) - len(missing)
    for spec, result in run(run_spec, list(missing)) if missing else ():
        missing[spec].log.add(result)
        done += 1
        progress(result, done, len(mine))


def tell(study: Study, results: Sequence[TrialResult]) -> Report:
    """The experiment's table; a trial that died has a row, and fails a check, as do those of
    other shards that are not there yet."""
    good, bad = [r for r in results if not r.fault], [r for r in results if r.fault]
    rows, checks = experiment_of(study.experiment).tell(good)
    rows = rows + [{"name": f"fault {r.mode} seed {r.seed}", "why": r.fault} for r in bad]
    wanted = len(study.specs())
    if len(results) < wanted:
        missing = float(wanted - len(results))
        checks = [*checks, Check(f"trials missing of the {wanted} wanted", missing, "", 0.0)]
    checks = [*checks, Check(DIED, float(len(bad)), "", 0.0)]
    return Report(study.experiment, study.seed, rows, checks)
