"""A recording into what plays it."""

from collections.abc import Mapping
from typing import Any

from app.record.recording import Recording
from app.replay.brain_of import brain_of
from app.replay.mind import Mind
from app.replay.open_loop import OpenLoop
from app.replay.player import Player
from app.replay.survey import Survey
from app.replay.timeline import Timeline
from app.timing import Clock


def mind_of(recording: Recording, changes: Mapping[str, Any]) -> Mind:
    """The brain that was, and beside it a ghost with `changes` to its settings if there are any."""
    brain = brain_of(recording.head)
    return Mind(brain, OpenLoop(brain_of(recording.head, brain), changes) if changes else None)


def player_of(
    recording: Recording, clock: Clock, changes: Mapping[str, Any], source: str = ""
) -> tuple[Player, Survey]:
    """A player at the first tick, not yet started, and the survey that it fills."""
    timeline = Timeline(recording, mind_of(recording, changes))
    survey = Survey(timeline)
    return Player(timeline, clock, source), survey
