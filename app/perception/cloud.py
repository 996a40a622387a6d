"""From frames to one cloud: place, check, filter; every zone keeps its verdict.

A frame is judged once, when it comes, at the posture the arm had when it was measured. A
tick only looks which frames have grown too old.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from app.cell.parts import Cell
from app.config import Params
from app.messages import SLOTS, Cloud, SensorFrame, Verdict, freeze
from app.perception.background import Background
from app.perception.beams import place
from app.perception.ghosts import Ghosts
from app.perception.self_filter import SelfFilter
from app.perception.static_filter import StaticFilter
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

VALID, MERGED = 5, 9  # target statuses: valid, valid with a merged pulse (UM3109)
KEPT, STATIC = int(Verdict.KEPT), int(Verdict.STATIC)  # numpy is slow with an enum
UNCONFIRMED = (6, 10)  # valid but with no previous target to compare with


class SkinCloud:
    """The newest judged frame of every sensor, in fixed slots."""

    def __init__(self, robot: Robot, skin: Skin, cell: Cell) -> None:
        self._skin = skin
        self._mount = skin.link.astype(np.int64)
        self._self_filter = SelfFilter(robot, skin)
        self.static_filter = StaticFilter(cell)
        self._ghosts = Ghosts(skin)
        self.background = Background(cell.learned)
        self.reset()

    def reset(self) -> None:
        """Forget every frame."""
        K, S = self._skin.count, self._skin.count * SLOTS
        self._points = np.full((S, 3), np.nan)
        self._verdict = np.full(S, Verdict.EMPTY, dtype=np.uint8)
        self._link = np.full(S, -1, dtype=np.int16)
        self._gap = np.full(S, np.inf)
        self._eps = np.full(S, np.nan)
        self._stamp = np.full(K, -np.inf)
        self._ghosts.reset()

    def take(self, frames: Sequence[SensorFrame], posture: Posture, params: Params) -> None:
        """Judge `frames`, all measured at `posture`; of two of one sensor the later one stays.

        A frame older than the one already held (reordered on its way) is ignored.
        """
        newest = {f.sensor: f for f in frames if f.stamp >= self._stamp[f.sensor]}
        if not newest:
            return
        sensors = np.fromiter(newest, dtype=np.intp)
        chosen = list(newest.values())
        depth = np.array([f.distance for f in chosen])
        if self._skin.ranges is not None:
            depth = self._skin.ranges.corrected(sensors, depth)
        status = np.array([f.status for f in chosen])
        targets = np.array([f.targets for f in chosen])
        slots = (sensors[:, None] * SLOTS + np.arange(SLOTS)).ravel()

        judged = self._self_filter.judge(sensors, depth, posture, params)
        verdict, gap = judged.verdict, judged.gap
        points = np.empty((*depth.shape, 3))
        skin = self._skin
        place(
            sensors, self._mount, skin.origin, skin.reach, skin.used, posture.T_base_link,
            depth, status, targets, _trusted(params.accept_merged, params.accept_unconfirmed),
            params.range_min, params.range_max, verdict, points,
        )  # fmt: skip
        flat = points.reshape(-1, 3)
        known = self.static_filter.inside(flat).reshape(verdict.shape)
        verdict[known & (verdict == KEPT)] = STATIC
        self._ghosts.doubt(sensors, depth, verdict, gap, params)
        self.background.take(points[verdict == KEPT], chosen[-1].stamp)

        self._points[slots] = flat
        self._verdict[slots] = verdict.ravel()
        self._link[slots] = judged.link.ravel()
        self._gap[slots] = gap.ravel()
        self._eps[slots] = judged.eps.ravel()
        self._stamp[sensors] = [f.stamp for f in chosen]

    def newest(self) -> Cloud:
        """The cloud without regard to age, not copied: it changes with the next `take`."""
        return Cloud(
            self._points, self._verdict, self._link, self._gap, self._eps, self._stamp
        )  # fmt: skip

    def view(self, now: float, params: Params) -> Cloud:
        """The cloud as it is at `now` [s]: frames beyond `frame_age` are stale."""
        verdict = self._verdict.copy()
        old = now - self._stamp > params.frame_age
        if old.any():
            rows = np.repeat(old, SLOTS) & (verdict != Verdict.EMPTY)
            verdict[rows] = Verdict.STALE
        return Cloud(
            points=freeze(self._points.copy()),
            verdict=freeze(verdict),
            link=freeze(self._link.copy()),
            gap=freeze(self._gap.copy()),
            eps=freeze(self._eps.copy()),
            stamp=freeze(self._stamp.copy()),
        )


@cache
def _trusted(merged: bool, unconfirmed: bool) -> NDArray[np.bool_]:
    """(256,) by target status: is it trusted?"""
    out = np.zeros(256, dtype=bool)
    out[VALID] = True
    out[MERGED] = merged
    out[list(UNCONFIRMED)] = unconfirmed
    return out
