"""Is the arm blocked before its goal, and may it try a way round?

Blocked: over `WINDOW` the tool has hardly come nearer though it is not there, and something
held it meanwhile. A person may simply walk away, so the arm first waits. Then, only if the
setting `escape` allows it, the goal is replaced by a place aside, across the direction that is
blocked: for `DETOUR` seconds at most, `ASIDE` metres at most, once in `PAUSE` seconds, each
side once. After that it stays blocked and says so. The bounds hold all the while.
"""

from collections import deque
from collections.abc import Sequence

import numpy as np

from app.control.goals import goal_error
from app.messages import Array, Command, Goal, Pairs, freeze

WINDOW = 2.0  # [s]
FAR, FAR_TURN = 0.03, 0.1  # [m], [rad] an error that is not yet there
GAIN, GAIN_TURN = 0.01, 0.03  # [m], [rad] less progress than this in a window is none
HELD = 0.5  # share of the window in which something held the arm
WAIT = 3.0  # [s] blocked before the first try
DETOUR, PAUSE = 4.0, 10.0  # [s]
ASIDE = (0.15, 0.30)  # [m]
ARRIVED = 0.03  # [m]
RESTS = 0.02  # [rad/s or m/s] an arm that does not move any more


class Stuck:
    """Detector and bounded escape; `goal` before the controller, `see` after it."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the past; a new goal begins anew."""
        self._past: deque[tuple[float, float, float, bool]] = deque()
        self._short = ""  # why the tool comes no nearer though nothing holds it
        self._held = 0  # of them, in which something held the arm
        self._real: Goal | None = None
        self._since: float | None = None  # blocked since
        self._aside: Goal | None = None
        self._begun = -np.inf
        self._tries = 0

    @property
    def words(self) -> str:
        """What to tell a person; empty while nothing is the matter."""
        if self._aside is not None:
            return f"blocked: tries a way round, {self._tries} of {2 * 4}"
        if self._since is not None:
            return "blocked: something stands between the tool and its goal"
        return self._short

    def blocked(self, now: float) -> float:
        """[s] for how long it has been blocked; 0 while it is not."""
        return max(now - self._since, 1e-3) if self._since is not None else 0.0

    def goal(self, goal: Goal | None, T_base_tool: Array, now: float) -> Goal | None:
        """The goal to control towards: the given one, or for a while a place aside."""
        if goal is None or self._real is None or _moved(goal, self._real):
            self.reset()
            self._real = goal
            return goal
        self._real = goal
        if self._aside is not None:
            error, _ = goal_error(T_base_tool, self._aside.T_base_tool)
            if error < ARRIVED or now - self._begun > DETOUR:
                self._aside = None
                self._past.clear()
                self._held = 0
                self._since = None
        return goal if self._aside is None else self._aside

    def see(
        self, T_base_tool: Array, pairs: Pairs, command: Command, escape: bool, now: float,
        ends: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Take note of a tick; may begin an escape.

        ends: names of joints that are at the end of their ranges.
        """
        if self._real is None or self._aside is not None:
            return
        error, turn = goal_error(T_base_tool, self._real.T_base_tool)
        held = command.control_row >= 0
        self._past.append((now, error, turn, held))
        self._held += held
        while now - self._past[0][0] > WINDOW:
            self._held -= self._past.popleft()[3]
        self._short = self._why_short(error, turn, command, ends)
        if not self._blocked(error, turn):
            self._since = None
            if error <= FAR and turn <= FAR_TURN:
                self._tries = 0
            return
        self._since = now if self._since is None else self._since
        waited = now - self._since > WAIT and now - self._begun > PAUSE
        if escape and waited and self._tries < 8 and command.control_row >= 0:
            self._aside = self._place(T_base_tool, pairs.normal[command.control_row])
            self._begun = now
            self._tries += 1

    def _blocked(self, error: float, turn: float) -> bool:
        (t0, e0, a0, _), t1 = self._past[0], self._past[-1][0]
        if t1 - t0 < 0.95 * WINDOW or (error <= FAR and turn <= FAR_TURN):
            return False
        held = self._held >= HELD * len(self._past)
        return held and e0 - error < GAIN and a0 - turn < GAIN_TURN

    def _why_short(self, error: float, turn: float, command: Command, ends: Sequence[str]) -> str:
        """In a window the tool has come no nearer, and nothing held it: it cannot."""
        (t0, e0, a0, _), t1 = self._past[0], self._past[-1][0]
        if t1 - t0 < 0.95 * WINDOW or (error <= FAR and turn <= FAR_TURN) or self._held:
            return ""
        if e0 - error >= GAIN or a0 - turn >= GAIN_TURN or np.abs(command.qd).max() > RESTS:
            return ""
        lacks = f"{error:.2f} m" if error > FAR else f"{np.degrees(turn):.0f} deg"
        at = f"{', '.join(ends)} at the end of its range" if ends else "the goal is out of reach"
        return f"no progress: {lacks} before the goal, {at}"

    def _place(self, T_base_tool: Array, normal: Array) -> Goal:
        """A place across the blocked direction, another one in each try."""
        across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        across /= np.linalg.norm(across)
        other = np.cross(normal, across)
        side = (across, -across, other, -other)[self._tries % 4]
        T = np.array(self._real.T_base_tool if self._real else T_base_tool)
        T[:3, 3] = T_base_tool[:3, 3] + ASIDE[self._tries // 4] * side
        return Goal(freeze(T))


def _moved(one: Goal, two: Goal) -> bool:
    """A goal that creeps, as a program's does, is the same goal; one that jumps is new."""
    step, turn = goal_error(one.T_base_tool, two.T_base_tool)
    return step > FAR or turn > FAR_TURN
