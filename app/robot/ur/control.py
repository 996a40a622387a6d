"""Velocity commands to a UR: the control program is begun, fed, and ended.

The program that `ur-rtde` uploads repeats the newest velocity for ever; the `time` of a
velocity command only says when it looks for a new one and is no watchdog. What stops the arm
when commands cease is the controller's own watchdog on the command register, which ends the
program (`rtde_set_watchdog`, UR script manual). It is set before the first velocity, and
whatever is sent afterwards, velocities or empty commands, must not pause for longer.
"""

from collections.abc import Callable

import numpy as np
from rtde_control import RTDEControlInterface

from app.errors import RobotError
from app.messages import Array
from app.robot.ur.dashboard import dashboard, version_of
from app.robot.ur.limits import ACCELERATION, WATCHDOG, capped
from app.robot.ur.link import E_SERIES, LOST

CYCLE = 0.002  # [s] until the program looks for a new velocity: one cycle of the controller
STILL = 1e-4  # [rad/s] no command and no motion
QUIET = 0.5  # [s] of stillness after which velocities cease
ENDED = (
    "the control program has ended (on the pendant, or because commands came too late); press Run "
    "to begin it again"
)
BRAKE = 50  # commands to brake on leaving, two cycles each: 0.2 s, and 0.13 s are needed


class Control:
    """A control program on `host` that runs; raises RobotError, in words, when it cannot.

    `model` is the arm that is expected there, as the dashboard names it; empty for any.
    """

    def __init__(self, host: str, model: str) -> None:
        remote, there, software = dashboard(
            host, "is in remote control", "get robot model", "PolyscopeVersion"
        )
        version = version_of(software)
        cb3 = bool(version) and version[0] < E_SERIES  # its pendant has no such switch
        if remote != "true" and not cb3:
            raise RobotError(
                f"{host} is not in remote control ({remote}); choose Remote Control at the top "
                "right of the pendant"
            )
        if model and there != model:
            raise RobotError(f"{host} is a {there}, not a {model}; give the right --robot")
        try:
            self._control = RTDEControlInterface(host)
        except RuntimeError as e:
            words = " ".join(str(e).split())
            raise RobotError(f"{host}: no control program could be started ({words})") from e
        self._broken = False
        self._guarded = False
        self._moving = False
        self._quiet = 0.0  # [s] for how long nothing has moved

    @property
    def trouble(self) -> str:
        """Why no command reaches the arm; empty while the program runs and is connected."""
        if self._broken or not self._control.isConnected():
            return LOST
        return "" if self._control.isProgramRunning() else ENDED

    def send(self, qd: Array, actual: Array, dt: float) -> Array:
        """Ask for the velocities `qd` (6,) [rad/s]; returns those that were really sent.

        Too fast ones are slowed together, so that the direction stays. Once the arm has stood
        for a while the motion is ended, and only the watchdog is fed until there is a new one.
        """
        try:
            return self._send(qd, actual, dt)
        except RuntimeError:
            # the socket broke in this very call; a tick that fails must be able to brake
            self._broken = True
            return np.zeros_like(qd)

    def _send(self, qd: Array, actual: Array, dt: float) -> Array:
        still = np.abs(qd).max() < STILL and np.abs(actual).max() < STILL
        self._quiet = self._quiet + dt if still else 0.0
        if still and not self._moving:
            if self._guarded:
                self._control.kickWatchdog()
            return np.zeros_like(qd)
        if self._quiet > QUIET:
            # not before the arm stands: a stop in motion waits for it, and feeds no watchdog
            self._control.speedStop(ACCELERATION)
            self._moving = False
            return np.zeros_like(qd)
        if not self._guarded:
            self._guarded = bool(self._control.setWatchdog(WATCHDOG))
            if not self._guarded:
                return np.zeros_like(qd)  # `trouble` will tell why
        asked = capped(qd)
        if not self._control.speedJ(list(asked), ACCELERATION, CYCLE):
            return np.zeros_like(qd)  # a safety stop, or no program: nothing was written
        self._moving = True
        return asked

    def close(self, pause: Callable[[float], object]) -> None:
        """Brake to rest and end the program; `pause` waits for some seconds. The connection ends
        with the process: the client's own way of leaving sleeps for a second."""
        for _ in range(BRAKE if self._moving else 0):
            if not self.trouble:
                self.send(np.zeros(6), np.ones(6), 2.0 * CYCLE)
                pause(2.0 * CYCLE)
        if not self.trouble:
            self._control.stopScript()
