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
