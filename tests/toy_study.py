"""An experiment of nothing, to run studies with: `python -m tests.toy_study toy FLAGS...`, or
`matrix FILE FLAGS...`.

Processes that a study starts import it too, since it is their main module.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import tyro

from app.cli.experiments.matrix import Matrix
from app.cli.experiments.trials import Trials
from app.errors import FlinchError
from app.studies.experiment import Experiment, Told, register
from app.studies.trial import TrialResult
from tests.toy_trial import run

NAME = "toy"


def told(good: Sequence[TrialResult]) -> Told:
    """The mean of each condition."""
    names = list(dict.fromkeys(t.mode for t in good))
    x = {n: [t.figures["x"] for t in good if t.mode == n] for n in names}
    return Told([{"name": n, "x": float(np.mean(x[n])), "trials": len(x[n])} for n in names], [])


TOY = register(
    Experiment(NAME, "Nothing.", ("good", "fine"), 3, 1.0, None, told, run=run, check=str)
)


@dataclass(frozen=True, kw_only=True)
class Toy(Trials):
    """Nothing."""

    experiment = NAME


if __name__ == "__main__":
    commands = tyro.extras.SubcommandApp()
    commands.command(name="toy")(Toy)
    commands.command(name="matrix")(Matrix)
    try:
        commands.cli()()
    except FlinchError as error:
        print(f"flinch: {error}", file=sys.stderr)
        sys.exit(1)
