"""`flinch experiment clutter`: reach into narrow places."""

from dataclasses import dataclass, replace
from pathlib import Path

from app.cli.experiments.trials import Trials
from app.errors import ConfigError


@dataclass(frozen=True)
class Clutter(Trials):
    """Reach into narrow places, on a table, in a box and in a shelf, with the whole map and
    without; or MotionBenchMaker's of a UR5, made into ones of a UR10e."""

    experiment = "clutter"
    problems: Path | None = None
    """A folder with pairs request####.yaml and scene####.yaml, or with folders of them, instead of
    the three sets; trial 0 is the first problem of each."""

    def __call__(self) -> None:
        if self.problems is None:
            super().__call__()
            return
        from app.studies.clutter.moveit import sets_of
        from app.studies.experiment import experiment_of

        sets = sets_of(self.problems)
        if any("," in str(folder) for folder in sets):
            raise ConfigError(f"{self.problems}: a comma in its name; rename it")
        given = (
            self.conditions.split(",") if self.conditions else experiment_of("clutter").conditions
        )
        conditions = ",".join(f"{c}@{folder}" for folder in sets for c in given)
        replace(self, conditions=conditions, problems=None)()
