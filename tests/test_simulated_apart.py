"""Simulated frames from another process: the same frames, and nobody waits for them."""

import os
import signal
import sys
import threading
import time

import numpy as np
import pytest

from app.actions import RemoveObstacle
from app.errors import SensorError
from app.sensing import simulated_apart
from app.sensing.budget import HONEST
from app.sensing.error_model import ErrorModel
from app.sensing.mixed import MixedSkin
from app.sensing.simulated import SimulatedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.world.scene import find_scene, load_scene
from app.world.world import World

TICK, SWITCH = 0.004, 0.2
EVERYONE = np.ones(30, dtype=bool)


def cell():
    scene = load_scene(find_scene("cell"))
    return World(scene.bodies)


def answered(eye, seconds=20.0):
    """Wait until the process has answered everything."""
    end = time.monotonic() + seconds
    while eye.unanswered:
        assert time.monotonic() < end
        time.sleep(0.001)


def ended(eye, seconds=20.0):
    """Wait until the process has ended."""
    end = time.monotonic() + seconds
    while eye._process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture
def apart(robot, skin):
    eye = SimulatedSkinApart(robot, skin, cell())
    yield eye
    eye.close()


def same(a, b):
    return (a.sensor, a.stamp, a.sequence) == (b.sensor, b.stamp, b.sequence) and all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("distance", "status", "targets")
    )


def test_the_frames_are_those_of_the_control_thread_bit_for_bit(robot, skin):
    worlds, errors = (cell(), cell()), ErrorModel(ghosts=0.01)
    here = SimulatedSkin(robot, skin, worlds[0], 3, errors, budget=HONEST)
    there = SimulatedSkinApart(robot, skin, worlds[1], 3, errors, budget=HONEST)
    heard, first = 0, 5.0
    try:
        assert there.poll(0.0, robot.posture(robot.home)) == []  # it has only begun
        assert there.fault(0.0, 0.5, EVERYONE) == ""
        there.wait()
        for i in range(300):
            now = first + i * TICK
            for world in worlds:  # as a person does while the arm moves
                if i in (50, 60):
                    world.add("", {"kind": "sphere", "radius_m": 0.15}, (0.5, 0.2, 0.4))
                if i > 100 and i % 7 == 0:
                    T = np.eye(4)
                    T[:3, 3] = [0.5, 0.2, 0.4 + i * TICK]
                    world.move("sphere 2", T)
                if i == 200:
                    world.remove("sphere 1")
                world.step(now - first)
            posture = robot.posture(robot.home + 0.3 * np.sin(now))
            here.muted = there.muted = {4, 5, 6} if 80 < i < 160 else set()
            answered(there)
            pairs = list(zip(here.poll(now, posture), there.poll(now, posture), strict=True))
            assert all(same(a, b) for a, b in pairs)
            heard += len(pairs)
        assert heard > 450
        assert there.inputs(now) == (("simulation", "in a process of its own, in time"),)
    finally:
        there.close()


def test_a_poll_never_gives_the_interpreters_lock_away(robot, skin, apart):
    apart.wait()
    posture, heard = robot.posture(robot.home), 0
    for i in range(20):
        apart.poll(i * TICK, posture)
        answered(apart)
    over, before = threading.Event(), sys.getswitchinterval()

    def busy():
        while not over.is_set():
            pass

    neighbour = threading.Thread(target=busy)
    try:
        neighbour.start()
        sys.setswitchinterval(SWITCH)  # what a thread waits that has given the lock away once
        time.sleep(0.0)
        begin = time.perf_counter()
        for i in range(20, 40):
            heard += len(apart.poll(i * TICK, posture))
        took = time.perf_counter() - begin
    finally:
        sys.setswitchinterval(before)
        over.set()
        neighbour.join()
    assert heard > 15
    assert took < SWITCH


def test_when_the_process_is_late_nobody_waits_and_no_frame_is_lost_or_redated(robot, skin, apart):
    apart.wait()
    posture = robot.posture(robot.home)
    for i in range(50):
        apart.poll(i * TICK, posture)
        answered(apart)
    os.kill(apart._process.pid, signal.SIGSTOP)
    late = [f for i in range(50, 150) for f in apart.poll(i * TICK, posture)]
    assert max(f.stamp for f in late) <= 50 * TICK
    said = dict(apart.inputs(149 * TICK))["simulation"]
    assert said.endswith("346 ms behind")  # not answered since tick 50, and 50 ms are due
    os.kill(apart._process.pid, signal.SIGCONT)
    answered(apart)
    caught_up = apart.poll(150 * TICK, posture)
    answered(apart)
    caught_up += apart.poll(200 * TICK, posture)
    stamps = [f.stamp for f in caught_up]
    assert {f.sensor for f in caught_up} == set(range(skin.count))
    assert stamps == sorted(stamps) and stamps[0] <= 51 * TICK and stamps[-1] == 150 * TICK
    assert dict(apart.inputs(200 * TICK))["simulation"].endswith("in time")


def test_a_process_that_dies_is_a_fault_in_words_and_the_thread_goes_on(robot, skin, apart):
    apart.wait()
    posture = robot.posture(robot.home)
    os.kill(apart._process.pid, signal.SIGINT)  # is for us, not for it
    apart.poll(0.0, posture)
    answered(apart)
    os.kill(apart._process.pid, signal.SIGKILL)
    ended(apart)
    for i in range(1, 100):
        apart.poll(i * TICK, posture)
    told = apart.fault(100 * TICK, 0.5, EVERYONE)
    assert told == "the simulation has ended (exit code -9); start again"
    assert apart.inputs(100 * TICK) == (("simulation", told),)
    assert apart.fault(100 * TICK, 0.5, ~EVERYONE) == ""  # nobody relies on it


def test_the_process_ends_with_the_other_side(apart):
    apart.wait()
    apart._line.close()  # as when the program is killed
    ended(apart)
    assert apart._process.returncode == 0


def test_a_process_that_cannot_begin_says_so_in_one_line(robot, skin, monkeypatch):
    monkeypatch.setattr(simulated_apart, "PROCESS", "app.sensing.nowhere")
    eye = SimulatedSkinApart(robot, skin, World(()))
    with pytest.raises(SensorError, match=r"^the simulation has ended \(exit code 1\); [^\n]*$"):
        eye.wait()
    eye.close()


def test_what_goes_wrong_in_the_process_is_told_here(robot, skin, apart):
    apart.wait()
    apart._note_edit(RemoveObstacle("cup"))  # which its world does not have
    posture = robot.posture(robot.home)
    apart.poll(0.0, posture)
    ended(apart)
    for i in range(1, 60):
        apart.poll(i * TICK, posture)
    assert "ended (there is no body 'cup' to be removed" in apart.fault(1.0, 0.5, EVERYONE)


class Nobody:
    """A real skin with two sensors that say nothing."""

    name = "nobody"
    connected = np.arange(30) < 2
    closed = False

    def poll(self, now, posture):
        return []

    def fault(self, now, silence, used):
        return ""

    def inputs(self, now):
        return (("port", "quiet"),)

    def close(self):
        self.closed = True


def test_a_mixed_skin_has_only_the_rest_simulated_and_ends_both(robot, skin, apart):
    apart.wait()
    real = Nobody()
    mixed, heard = MixedSkin(real, apart), set()
    posture = robot.posture(robot.home)
    for i in range(60):
        heard |= {f.sensor for f in mixed.poll(i * TICK, posture)}
        answered(apart)
    assert heard == set(range(2, 30))
    assert [name for name, _ in mixed.inputs(0.0)] == ["port", "simulation"]
    mixed.close()
    assert real.closed and apart._process.poll() is not None
