"""Experiments of trials in scenes, one class each."""

from dataclasses import dataclass

from app.cli.experiments.trials import Trials


@dataclass(frozen=True)
class FrontPanel(Trials):
    """Hold a plate ahead of the tool, and let the goal lie behind it or on it."""

    experiment = "front-panel"


@dataclass(frozen=True)
class SidePanel(Trials):
    """Hold a plate beside the forearm, left or right, and let the goal lie behind it."""

    experiment = "side-panel"


@dataclass(frozen=True)
class Approach(Trials):
    """Let a person walk at the arm, and past it, at four speeds."""

    experiment = "approach"


@dataclass(frozen=True)
class Faults(Trials):
    """Let sensors fail, in every way and number, and say what the arm ran into and what it cost."""

    experiment = "faults"


@dataclass(frozen=True)
class Occlusion(Trials):
    """Show the arm a thing for a while, and let it come back to where it is hidden."""

    experiment = "occlusion"


@dataclass(frozen=True)
class Worlds(Trials):
    """Run every controller in the same random worlds, and say why it touched what it touched.

    A trial ends before its time with a touch."""

    experiment = "worlds"


@dataclass(frozen=True)
class Elementary(Trials):
    """Let a ball stand near the arm, cross its way and come at it, in 27 short situations."""

    experiment = "elementary"
