"""From frames to one cloud: place, check, filter; every zone keeps its verdict.

A frame is judged once, when it comes, at the posture the arm had when it was measured. A
tick only looks which frames have grown too old.
"""

from collections.abc import Sequence

import numpy as np

from app.config import Params
from app.messages import SLOTS, Cloud, CropBox, SensorFrame, Verdict, freeze
from app.perception.self_filter import SelfFilter
from app.perception.static_filter import StaticFilter
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

VALID = (5, 9)  # target statuses that are trusted: valid, valid with a merged pulse (UM3109)
UNCONFIRMED = (6, 10)  # valid but with no previous target to compare with


class SkinCloud:
    """The newest judged frame of every sensor, in fixed slots."""

    def __init__(self, robot: Robot, skin: Skin, crops: Sequence[CropBox]) -> None:
        self._skin = skin
        self._self_filter = SelfFilter(robot, skin)
        self._static_filter = StaticFilter(crops)
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

    def take(self, frames: Sequence[SensorFrame], posture: Posture, params: Params) -> None:
        """Judge `frames`, all measured at `posture`; of two of one sensor the later one stays.

        A frame older than the one already held (reordered on its way) is ignored.
        """
        newest = {f.sensor: f for f in frames if f.stamp >= self._stamp[f.sensor]}
        if not newest:
            return
        sensors = np.fromiter(newest, dtype=np.intp)
        chosen = list(newest.values())
        m = len(chosen)
        depth = np.array([f.distance for f in chosen])
        status = np.array([f.status for f in chosen])
        targets = np.array([f.targets for f in chosen])
        slots = (sensors[:, None] * SLOTS + np.arange(SLOTS)).ravel()
        used = self._skin.used[slots].reshape(m, SLOTS)

        points = self._place(sensors, slots, depth, posture)
        verdict, link, gap, eps = self._self_filter.judge(sensors, depth, posture, params)
        kept = verdict == Verdict.KEPT
        kept[kept] = self._static_filter.inside(points[kept.ravel()])
        verdict[kept] = Verdict.STATIC
        far = (depth < params.range_min) | (depth > params.range_max)
        verdict[far] = Verdict.OUT_OF_RANGE
        trusted = VALID + UNCONFIRMED if params.accept_unconfirmed else VALID
        verdict[~np.isin(status, trusted)] = Verdict.BAD_STATUS
        nothing = (targets == 0) | (status == 255)
        verdict[nothing] = Verdict.NO_TARGET
        verdict[~used] = Verdict.EMPTY
        points[(nothing | ~used).ravel()] = np.nan  # their distance is junk

        self._points[slots] = points
        self._verdict[slots] = verdict.ravel()
        self._link[slots] = link.ravel()
        self._gap[slots] = gap.ravel()
        self._eps[slots] = eps.ravel()
        self._stamp[sensors] = [f.stamp for f in chosen]

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

    def _place(
        self, sensors: np.ndarray, slots: np.ndarray, depth: np.ndarray, posture: Posture
    ) -> np.ndarray:
        """Points (m * 64, 3) [m], base frame."""
        skin = self._skin
        local = skin.reach[slots] * depth.reshape(-1, 1)
        local += np.repeat(skin.origin[sensors], SLOTS, axis=0)
        out = np.empty_like(local)
        for i, k in enumerate(sensors):
            T = posture.T_base_link[skin.link[k]]
            rows = slice(i * SLOTS, (i + 1) * SLOTS)
            out[rows] = local[rows] @ T[:3, :3].T + T[:3, 3]
        return out
