"""A virtual skin on the arm of a virtual UR: what it sees is seen from where the arm is."""

import subprocess
import sys

import numpy as np
import pytest

from app.cli import main
from app.errors import SensorError
from app.messages import Verdict
from app.robot.model import find_robot, load_robot
from app.setup import Setup
from app.timing import WallClock
from app.virtual.skin.wearer import wearer
from app.wiring import build_engine
from tests.virtual_ur import VirtualUr

CLOCK = WallClock()
RADIUS = 0.08
SCENE = """title = "a ball"
[[body]]
name = "ball"
shape = {{ kind = "sphere", radius_m = {} }}
position_m = {}
"""


def turn(ur, speed):
    """Turn the first joint [rad/s] without a client, and without a watchdog."""
    ur.call("upload", "def rtde_control():\nend\n")
    numbers = [speed, 0.0, 0.0, 0.0, 0.0, 0.0, 40.0, 0.002]
    registers = {f"input_double_register_{i}": x for i, x in enumerate(numbers)}
    ur.call("write", registers | {"input_int_register_0": 9})


def seen(engine, wanted, limit=30.0):
    end = CLOCK.now() + limit
    while CLOCK.now() < end:
        snapshot, _ = engine.snapshots.get()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        CLOCK.sleep_until(CLOCK.now() + 0.02)
    raise AssertionError(f"not within {limit} s; {snapshot and snapshot.status}")


def kept(snapshot):
    return snapshot.cloud.points[snapshot.cloud.verdict == Verdict.KEPT]


@pytest.fixture
def ur():
    with VirtualUr() as virtual:
        yield virtual


@pytest.mark.slow
def test_points_stay_on_the_thing_while_the_arm_turns(ur, robot, skin, tmp_path):
    k = skin.index("ring2-03")
    T = robot.posture(robot.home).T_base_link[skin.link[k]]
    ball = T[:3, :3] @ (skin.origin[k] + 0.35 * skin.axis[k]) + T[:3, 3]
    scene, link = tmp_path / "ball.toml", tmp_path / "skin"
    scene.write_text(SCENE.format(RADIUS, ball.tolist()))
    flags = ["--link", str(link), "--scene", str(scene), "--follow", f"ur:{ur.host}"]
    board = subprocess.Popen(
        [sys.executable, "-m", "app", "skin", "emulate", *flags], stdout=subprocess.PIPE, text=True
    )
    try:
        assert "ring1-01 to ring3-10" in board.stdout.readline()
        setup = Setup(scene=str(scene), sensors=f"serial:{link}", driver=f"ur:{ur.host}")
        engine = build_engine(setup, CLOCK)
        engine.start()
        try:
            first = seen(engine, lambda s: len(kept(s)) > 10, limit=120.0)
            turn(ur, 0.2)
            seen(engine, lambda s: abs(s.joints.q[0] - first.joints.q[0]) > 0.25)
            turn(ur, 0.0)
            at = CLOCK.now()  # every sensor speaks anew from where the arm is now
            last = seen(engine, lambda s: s.stamp > at + 0.5 and np.abs(s.joints.qd).max() < 1e-3)
        finally:
            engine.close()
    finally:
        board.terminate()
        board.communicate(timeout=30)
    for snapshot in (first, last):
        off = np.abs(np.linalg.norm(kept(snapshot) - ball, axis=1) - RADIUS)
        assert len(off) > 10 and np.median(off) < 0.02 and np.percentile(off, 90) < 0.05
    before, after = (s.T_base_link[skin.link[k]] @ [*skin.origin[k], 1.0] for s in (first, last))
    assert np.linalg.norm(after - before) > 0.05  # a skin that stood still would be off by that


def test_what_cannot_be_followed_is_one_line(tmp_path, capsys):
    link = ["skin", "emulate", "--link", str(tmp_path / "x")]
    for flags, says in (
        (["--follow", "127.0.0.1"], "give 'ur:HOST'"),
        (["--follow", "ur:127.0.0.1:30004"], "a UR's ports are fixed"),
        (["--follow", "ur:h", "--replay", "x"], "leave --replay or --follow out"),
        (["--follow", "ur:127.9.9.9"], "127.9.9.9"),
    ):
        assert main([*link, *flags]) == 1
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and says in err
    with pytest.raises(SensorError, match="swan7 has 7 joints, a UR six"):
        wearer("ur:127.0.0.1", load_robot(find_robot("swan7")), np.zeros(7))
