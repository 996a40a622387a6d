"""Recorded frames of real sensors, where they are at hand: ../shared/data or FLINCH_DATA."""

import os
from pathlib import Path

import numpy as np
import pytest

from app.brain import Brain
from app.config import Params
from app.messages import JointState, Mode, Verdict
from app.plant.plant import listen
from app.sensing.replay import Replay, read_recording
from app.tick import ArmReport, Inputs

DATA = Path(os.environ.get("FLINCH_DATA", Path(__file__).parents[2] / "shared" / "data")) / "tof"
LOGS = sorted(DATA.glob("*/*/state_ToF.csv"))
NEAR, FAR = 0.45, 1.3  # [m] of an approach: nearer, the panel fills few zones; farther, none
MIDDLE = [8 * r + c for r in (2, 3, 4) for c in (2, 3, 4, 5)]  # above the floor

needs_data = pytest.mark.skipif(
    not LOGS, reason=f"the recorded logs are not here ({DATA}); set FLINCH_DATA to their folder"
)


@needs_data
@pytest.mark.parametrize("log", LOGS, ids=lambda p: p.parent.name)
def test_every_log_runs_through_replay_and_brain(log, robot, skin):
    recording = read_recording(log)
    replay = Replay(recording, skin, 15)
    brain = Brain(robot, skin, params=Params(memory=True, silence=2.0), begin=Mode.HOLDING)
    posture = robot.posture(robot.home)
    still, seen = np.zeros(robot.n), 0
    for i in range(int(30.0 * min(recording.stamp[-1], 30.0))):
        now = i / 30.0
        joints = JointState(now, robot.home, still)
        frames, said = listen(replay, now, posture, 5.0)
        x = Inputs(i, now, 1 / 30.0, 0.0, joints, still, ArmReport(), frames, said)
        out = brain.tick(x)
        assert not out.trace
        assert np.isfinite(out.command.qd).all()
        kept = out.cloud.verdict == Verdict.KEPT
        assert np.isfinite(out.cloud.points[kept]).all()
        seen += int(kept.sum())
    assert seen > 1000


def approach(log):
    """(n,) time [s], depth seen [m] and distance by motion capture [m] of the first approach."""
    recording = read_recording(log)
    begin = int(log.read_text(encoding="ascii").split(",", 1)[0]) / 1e3
    time = begin + recording.stamp
    rows = [r.split(",") for r in (log.parent / "state_Vicon.csv").read_text().splitlines()[1:]]

    def track(name):
        a = np.array([[float(v) for v in r[1:5]] for r in rows if r[0] == name])
        return np.stack([np.interp(time, a[:, 0] / 1e3, a[:, i]) for i in (1, 2, 3)], axis=1)

    truth = np.linalg.norm((track("Drone") - track("Surface"))[:, :2], axis=1)
    good = (recording.targets > 0) & np.isin(recording.status, (5, 9))
    depth = np.where(good, recording.distance, np.nan)[:, MIDDLE]
    enough = np.isfinite(depth).sum(axis=1) >= 4
    seen = np.full(len(time), np.nan)
    seen[enough] = np.nanmedian(depth[enough], axis=1)
    first = int(np.argmax(truth < NEAR)) if (truth < NEAR).any() else int(truth.argmin())
    start = first - int(np.argmax(truth[:first][::-1] > FAR))
    part = slice(start, first)
    ok = np.isfinite(seen[part])
    return time[part][ok], seen[part][ok], truth[part][ok]


@needs_data
@pytest.mark.parametrize(
    "log", [p for p in LOGS if p.parts[-3] == "Approach"], ids=lambda p: p.parent.name
)
def test_a_recorded_approach_falls_steadily_and_as_fast_as_motion_capture_says(log):
    time, seen, truth = approach(log)
    assert len(time) > 15
    slope, true_slope = np.polyfit(time, seen, 1)[0], np.polyfit(time, truth, 1)[0]
    print(f"{log.parent.name}: {slope:.3f} m/s seen, {true_slope:.3f} m/s by motion capture")
    assert true_slope < -0.1
    assert slope == pytest.approx(true_slope, rel=0.15)
    rise = np.diff(np.convolve(seen, np.ones(3) / 3, mode="valid"))
    assert rise.max() < 0.03  # of means over three frames: noise
