"""Driving the arm through the postures of a plan while all that comes in is recorded.

Nothing gives way here: the ways were checked against the cell before, and people keep out.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from app.calibration.postures import BENDS, Plan, travel_time
from app.calibration.recording import Recorder, Recording
from app.errors import FlinchError, SensorError
from app.messages import Array
from app.plant.plant import Plant, Reading
from app.robot.model import Robot
from app.robot.skin import Skin
from app.timing import Clock, Ticker

RATE = 125.0  # ticks a second
PULL = 6.0  # [1/s] how fast what is left of the way is made up for
AHEAD = 0.03  # [s] that a velocity loop lags
MOST = 1.25  # times the plan's speed that a joint may be told
ASTRAY = 0.15  # [rad] from where it should be: something holds the arm
PATIENCE = 1.0  # [s] of silent sensors
ENGAGING = 10.0  # [s] that an arm is given to be ready

Progress = Callable[[float], None]  # told which share of the motion is done
Moves = Callable[[bool], None]  # told whether the arm sets out or rests


def unheeded(moves: bool) -> None:
    """Nobody needs to know."""


class Drive:
    """Moves a plant's arm, `speed` [rad/s] at most, and records."""

    def __init__(self, robot: Robot, skin: Skin, plant: Plant, clock: Clock, speed: float) -> None:
        self._plant, self._clock, self._speed = plant, clock, speed
        self._recorder = Recorder(robot, skin)
        self._ticker = Ticker(clock, 1.0 / RATE)

    def run(
        self, plan: Plan, rest: float, progress: Progress, moves: Moves = unheeded
    ) -> Recording:
        """Visit every posture, `rest` [s] in each.

        Raises FlinchError, and the arm brakes, when it or the skin reports a fault.
        """
        q, done = plan.q, rest
        try:
            self._make_ready()
            self._follow(q[0], np.zeros_like(q[0]), rest)
            for a, b in pairwise(q):
                progress(min(done / plan.seconds, 1.0))
                moves(True)
                takes = travel_time(b - a, self._speed)
                self._follow(a, b - a, takes)
                moves(False)
                self._follow(b, np.zeros_like(b), rest)
                done += takes + rest
            progress(1.0)
        finally:
            self._plant.send(np.zeros(q.shape[1]), 1.0 / RATE)
        return self._recorder.done()

    def _make_ready(self) -> None:
        """Have the arm follow commands."""
        self._plant.engage()
        begin = self._clock.now()
        while not (reading := self._read()).arm.ready:
            if self._clock.now() - begin > ENGAGING:
                why = reading.arm.fault or reading.arm.advice
                raise FlinchError(f"the arm is not ready after {ENGAGING:g} s: {why}")

    def _follow(self, begin: Array, way: Array, seconds: float) -> None:
        """Go `way` (n,) [rad] from `begin` (n,), or rest where it is nothing."""
        start, most = self._clock.now(), MOST * self._speed
        while (t := self._clock.now() - start) < seconds:
            share, rate = along(t, way, self._speed)[0], along(t + AHEAD, way, self._speed)[1]
            reading = self._read()
            fault = reading.arm.fault or reading.source.fault or reading.source.ended
            if fault:
                raise SensorError(f"the calibration stops: {fault}")
            off = begin + share * way - reading.joints.q
            if np.abs(off).max() > ASTRAY:
                raise FlinchError(
                    "the calibration stops: the arm is not where it was sent; look what holds it, "
                    "and whether its speed slider is at 100 %"
                )
            self._plant.send(np.clip(rate + PULL * off, -most, most), 1.0 / RATE)

    def _read(self) -> Reading:
        """One tick's reading, recorded."""
        self._ticker.wait()
        reading = self._plant.read(self._clock.now(), PATIENCE)
        self._recorder.add(reading.joints, reading.frames)
        return reading


def along(t: float, way: Array, speed: float) -> tuple[float, Array]:
    """Share of a way (n,) from rest to rest that is done at `t` [s], and rate (n,) [rad/s]:
    faster with `BENDS`, even, slower."""
    far = float(np.abs(way).max())
    if far == 0.0:
        return 0.0, np.zeros(len(way))
    top = min(speed, float(np.sqrt(far * BENDS)))
    left, ramp = travel_time(way, speed) - t, top / BENDS
    if t < ramp:
        gone = BENDS * t**2 / 2
    elif left > ramp:
        gone = top * (t - ramp / 2)
    else:
        gone = far - BENDS * max(left, 0.0) ** 2 / 2
    return gone / far, np.asarray(way / far * max(min(top, BENDS * t, BENDS * left), 0.0))
