"""A trial of nothing, whose condition is what happens; it imports next to nothing either, so that
processes are quickly there."""

import os
import signal
import time
from pathlib import Path

from app.studies.trial import TrialResult, TrialSpec


def run(spec: TrialSpec) -> TrialResult:
    """A condition is what happens: good, slow:SECONDS, killed, once:FILE (killed the first time,
    which makes the file), or bad."""
    what, _, value = spec.condition.partition(":")
    if what == "slow":
        time.sleep(float(value))
    if what == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "once" and not Path(value).exists():
        Path(value).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "bad":
        raise ValueError("bad luck")
    x = 1.0 / (3.0 + spec.seed)
    figures = {"x": x, "n": spec.seed, "never": float("nan"), "list": [1.0], "words": "a,b"}
    return TrialResult(spec.seed, spec.condition, figures, {"x": [x, 2.0 * x]})
