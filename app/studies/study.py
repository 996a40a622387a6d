"""A study: which trials of an experiment are wanted, run where they are missing, and told of."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.report import Check, Report
from app.studies.experiment import Experiment, experiment_of, run_spec
from app.studies.pool import each, shard_of
from app.studies.trial import TrialResult, TrialSpec
from app.studies.trial_log import TrialLog

# Runs trials somewhere and gives back each result when it is there, in any order.
Run = Callable[[Callable[[TrialSpec], TrialResult], Sequence[TrialSpec]], Iterator[TrialResult]]
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


def locally(jobs: int = 1) -> Run:
    """On this machine, in `jobs` processes."""
    return lambda trial, specs: each(trial, specs, jobs)


def run_study(
    study: Study, run: Run, log: Path | None = None, shard: str = "1/1",
    progress: Progress = lambda result, done, wanted: None,
) -> list[TrialResult]:  # fmt: skip
    """All wanted trials of the shard, in their order; those in `log` are not run again."""
    specs = list(shard_of(study.specs(), shard))
    known = TrialLog(log, study.settings, TrialResult)
    missing = [s for s in specs if (s.seed, s.condition) not in known.done]
    done = len(specs) - len(missing)
    for result in run(run_spec, missing) if missing else ():
        known.add(result)
        done += 1
        progress(result, done, len(specs))
    return [known.done[s.seed, s.condition] for s in specs]


def tell(study: Study, results: Sequence[TrialResult]) -> Report:
    """The experiment's table; a trial that died has a row, and fails a check."""
    good, bad = [r for r in results if not r.fault], [r for r in results if r.fault]
    rows, checks = experiment_of(study.experiment).tell(good)
    rows = rows + [{"name": f"fault {r.mode} seed {r.seed}", "why": r.fault} for r in bad]
    checks = [*checks, Check("trials that died", float(len(bad)), "", 0.0)]
    return Report(study.experiment, study.seed, rows, checks)
