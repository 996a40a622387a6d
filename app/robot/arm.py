"""A simulated arm: integrates commanded joint velocity, as a real one would follow it."""

import numpy as np

from app.messages import Array, JointState, freeze
from app.robot.model import Robot
from app.tick import ArmReport, Limits

LAG = 0.03  # [s] first-order lag of the velocity loop


class SimulatedArm:
    """Follows velocity commands with a lag, under acceleration, velocity and position limits."""

    def __init__(
        self, robot: Robot, q: Array | None = None, lag: float = LAG, noise: float = 0.0,
        seed: int = 0,
    ) -> None:  # fmt: skip
        """noise: [rad or m] standard deviation of each joint's encoder, drawn with `seed`."""
        self._robot, self._lag = robot, lag
        self._noise, self._rng = noise, np.random.default_rng(seed)
        self._read = JointState(-np.inf, np.empty(0), np.empty(0))
        q = np.clip(robot.home if q is None else q, robot.q_min, robot.q_max)
        self._q = robot.gears.place(q)
        self._qd = np.zeros(robot.n)
        self._told = freeze(np.zeros(robot.n))
        self.limits = Limits(robot.qd_max, robot.qdd_max)

    def state(self, now: float) -> JointState:
        """Where the arm is, as its encoders say; the same whenever it is asked for at `now`."""
        if not self._noise:
            return JointState(now, freeze(self._q.copy()), freeze(self._qd.copy()))
        if now != self._read.stamp:
            read = self._q + self._noise * self._rng.standard_normal(len(self._q))
            # no encoder says that its joint is beyond the stop against which it was set
            read = np.clip(read, self._robot.q_min, self._robot.q_max)
            read = self._robot.gears.place(read)
            self._read = JointState(now, freeze(read), freeze(self._qd.copy()))
        return self._read

    @property
    def q(self) -> Array:
        """(n,) where the joints truly are."""
        return self._q

    def report(self, now: float) -> ArmReport:
        """Nothing can be wrong with it."""
        return ArmReport()

    def applied(self, now: float) -> Array:
        """What it was told last (n,) [rad/s]."""
        return self._told

    def engage(self) -> None:
        """It is always ready."""

    def close(self) -> None:
        """There is nothing to leave."""

    def send(self, qd: Array, dt: float) -> Array:
        """Be told `qd` (n,) for `dt` [s]; returns what was taken of it within the limits.

        The joints follow it with the lag; how far they are is in `state`.
        """
        if not np.isfinite(qd).all():
            raise ValueError("a command with a non-finite joint velocity")
        r = self._robot
        step = (1.0 - np.exp(-dt / self._lag)) if self._lag > 0.0 else 1.0
        told = self._told = freeze(r.gears.speed(np.clip(qd, -r.qd_max, r.qd_max)))
        change = np.clip(step * (told - self._qd), -r.qdd_max * dt, r.qdd_max * dt)
        moved = np.clip(self._qd + change, -r.qd_max, r.qd_max)
        q = np.clip(self._q + moved * dt, r.q_min, r.q_max)
        # at a mechanical end the joint stands, whatever was asked
        self._qd = r.gears.speed(np.where(q == self._q + moved * dt, moved, 0.0))
        self._q = r.gears.place(q)
        return told
