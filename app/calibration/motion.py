"""Driving the arm through the postures of a plan while all that comes in is recorded."""

from collections.abc import Callable

import numpy as np

from app.calibration.postures import BENDS, Plan, travel_time
from app.calibration.recording import Recorder, Recording
from app.errors import SensorError
from app.messages import Array
from app.plant.plant import Arm
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.source import Source
from app.timing import Clock, Ticker

RATE = 125.0  # ticks a second
PULL = 4.0  # [1/s] how fast what is left of the way is made up for
MOST = 1.25  # times the plan's speed that a joint may be told
ENGAGING = 10.0  # [s] that an arm is given to be ready

Progress = Callable[[float], None]  # told which share of the motion is done


class Drive:
    """An arm, its skin's frames, and where they are recorded."""

    def __init__(
        self, robot: Robot, skin: Skin, arm: Arm, source: Source, clock: Clock, speed: float
    ) -> None:
        self._robot, self._arm, self._source, self._clock = robot, arm, source, clock
        self._speed, self._recorder = speed, Recorder(robot, skin)
        self._ticker = Ticker(clock, 1.0 / RATE)

    def run(self, plan: Plan, rest: float, progress: Progress) -> Recording:
        """Visit every posture, `rest` [s] in each; raises FlinchError, and the arm brakes, when it
        or the skin reports a fault."""
        q, done = plan.q, 0.0
        try:
            self._stand(rest + self._ready())
            for a, b in zip(q[:-1], q[1:], strict=True):
                progress(done / max(plan.seconds, 1e-9))
                takes = travel_time(b - a, self._speed)
                begin = self._clock.now()
                while (t := self._clock.now() - begin) < takes:
                    self._tick(
                        a + (b - a) * _share(t, b - a, self._speed), _rate(t, b - a, self._speed)
                    )
                self._stand(rest, b)
                done += takes + rest
            progress(1.0)
        finally:
            self._arm.send(np.zeros(self._robot.n), 1.0 / RATE)
        return self._recorder.done()

    def _ready(self) -> float:
        """Have the arm follow commands; [s] it took, at most `ENGAGING`."""
        self._arm.engage()
        begin = self._clock.now()
        while not self._report_ready() and self._clock.now() - begin < ENGAGING:
            self._ticker.wait()
        return 0.0

    def _report_ready(self) -> bool:
        return self._arm.report(self._clock.now()).ready

    def _stand(self, seconds: float, at: Array | None = None) -> None:
        begin = self._clock.now()
        at = self._arm.state(begin).q.copy() if at is None else at
        while self._clock.now() - begin < seconds:
            self._tick(at, np.zeros(len(at)))

    def _tick(self, wanted: Array, rate: Array) -> None:
        """One tick: record, and follow `wanted` (n,) that moves at `rate` (n,) [rad/s]."""
        self._ticker.wait()
        now = self._clock.now()
        state = self._arm.state(now)
        frames = self._source.poll(now, self._robot.posture(state.q))
        self._recorder.add(state, frames)
        report = self._arm.report(now)
        connected = self._source.connected
        fault = report.fault or self._source.fault(now, 1.0, connected) or self._source.ended()
        if fault:
            raise SensorError(f"the calibration stops: {fault}")
        most = MOST * self._speed
        qd = np.clip(rate + PULL * (wanted - state.q), -most, most)
        self._arm.send(qd if np.abs(wanted - state.q).max() > 1e-4 else rate, 1.0 / RATE)


def _share(t: float, way: Array, speed: float) -> float:
    """0..1 of a way from rest to rest at a time: faster, even, slower."""
    far = max(float(np.abs(way).max()), 1e-9)
    top = min(speed, float(np.sqrt(far * BENDS)))
    takes, ramp = travel_time(way, speed), top / BENDS
    if t < ramp:
        gone = BENDS * t**2 / 2
    elif t < takes - ramp:
        gone = top * (t - ramp / 2)
    else:
        gone = far - BENDS * max(takes - t, 0.0) ** 2 / 2
    return gone / far


def _rate(t: float, way: Array, speed: float) -> Array:
    """(n,) [rad/s] of the same."""
    far = max(float(np.abs(way).max()), 1e-9)
    top = min(speed, float(np.sqrt(far * BENDS)))
    left = travel_time(way, speed) - t
    return np.asarray(way / far * max(min(top, BENDS * t, BENDS * left), 0.0))
