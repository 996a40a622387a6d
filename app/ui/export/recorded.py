"""Recordings as what can be exported: the arm of each, and its ticks recomputed in their order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.errors import RecordingError
from app.messages import Snapshot
from app.record.reader import open_recording
from app.record.recording import Recording
from app.replay.made import mind_of
from app.replay.timeline import Timeline
from app.ui.export.export import Exported, Part, exported
from app.ui.export.film import Arm
from app.ui.export.pages import page_of

CLOSER = 0.85  # the eye of scenes that stand side by side, since they are narrower


def page_from(paths: Sequence[Path], part: Part, ghost: Mapping[str, Any] | None = None) -> str:
    """The page of recordings, side by side if there are several.

    Raises RecordingError for a file that is none or holds no tick, and for two robots on one page.
    """
    arms: list[Arm] = []
    clips: list[Exported] = []
    origins: list[str] = []
    for path in paths:
        with open_recording(path) as recording:
            if not len(recording):
                raise RecordingError(f"{path}: holds no tick ({recording.torn or 'it is empty'})")
            arm, run = run_of(recording, part, ghost)
            if arms and arm.robot.name != arms[0].robot.name:
                raise RecordingError(
                    f"{path}: is of {arm.robot.title}, {paths[0]} of {arms[0].robot.title}; only "
                    "recordings of one robot stand side by side"
                )
            arms.append(arm)
            closer = 1.0 if len(paths) == 1 else CLOSER
            clips.append(exported(arm, run, part.stride, closer=closer))
            origins.append(origin_of(recording))
    return page_of(arms[0], clips, " ".join(dict.fromkeys(origins)))


def run_of(
    recording: Recording, part: Part, ghost: Mapping[str, Any] | None = None
) -> tuple[Arm, Iterator[Snapshot]]:
    """The arm that was recorded, and every tick of the part.

    ghost: settings of another brain that is given the same frames, None: no ghost.

    Raises what `app.replay.brain_of` does.
    """
    timeline = Timeline(recording, mind_of(recording, ghost or {}))
    brain, head = timeline.mind.brain, recording.head
    arm = Arm(brain.robot, brain.skin, brain.cell, head.scene, head.source)
    return arm, _ticks(timeline, part)


def _ticks(timeline: Timeline, part: Part) -> Iterator[Snapshot]:
    times = timeline.recording.times
    for i in range(len(timeline)):
        seconds = times[i] - times[0]
        if seconds > part.end:
            return
        if seconds >= part.begin:
            yield ahead(timeline, i)
        else:
            timeline.reach(i)


def ahead(timeline: Timeline, i: int) -> Snapshot:
    """Tick i; a ghost's distance is the one that its command would lead to, as it is drawn."""
    snapshot, loop = timeline.snapshot(i), timeline.mind.ghost
    if loop is None or snapshot.ghost is None:
        return snapshot
    inputs, outputs = timeline.tick(i)
    distance = loop.ahead.distance(inputs.joints.q, snapshot.ghost.command.qd, outputs)
    return replace(snapshot, ghost=replace(snapshot.ghost, distance=distance))


def origin_of(recording: Recording) -> str:
    """Where it comes from, in a sentence or two."""
    head = recording.head
    when = datetime.fromtimestamp(head.began, UTC).strftime("%Y-%m-%d %H:%M UTC")
    setup = head.setup
    simulated = setup.sensors == "simulated"
    kind = f"simulated, {setup.world} world, seed {setup.seed}" if simulated else head.source
    words = [f"Recorded {when} by Flinch {head.flinch}: {kind}."]
    if recording.dropped:
        words.append(f"{recording.dropped} ticks are missing.")
    if recording.torn:
        words.append(f"It ends early: {recording.torn}.")
    return " ".join(words)
