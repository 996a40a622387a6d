"""From frames to one cloud: place, check, filter; every zone keeps its verdict.

A frame is judged once, when it comes, at the posture the arm had when it was measured. A
tick only looks which frames have grown too old.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cell.parts import Cell
from app.messages import Array, Cloud, SensorFrame, Verdict, freeze
from app.perception.background import Background
from app.perception.behind import FARTHEST
from app.perception.between import Between
from app.perception.contact import Contacts
from app.perception.ghosts import Ghosts
from app.perception.hanging import Hanging
from app.perception.placing import Lenses, Reports, place_points
from app.perception.proof import Proof
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter, View, no_judgement
from app.perception.static_filter import StaticFilter
from app.perception.unable import Unable
from app.perception.windows import DirtyWindows, Sight
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

KEPT, STATIC = int(Verdict.KEPT), int(Verdict.STATIC)  # numpy is slow with an enum
SEES, DIRTY_WINDOW = np.uint8(Unable.SEES), np.uint8(Unable.DIRTY_WINDOW)
LASTING = np.zeros(len(Verdict), dtype=bool)  # by verdict: does it outlast the frame's age?
LASTING[[Verdict.EMPTY, Verdict.CONTACT]] = True


class Together(NamedTuple):
    """Frames that were measured at one posture, where the arm moved with qd (n,) [rad/s]; None: it
    stood."""

    frames: Sequence[SensorFrame]
    posture: Posture
    qd: Array | None


class SkinCloud:
    """The newest judged frame of every sensor, in the skin's slots."""

    def __init__(self, robot: Robot, skin: Skin, cell: Cell) -> None:
        self._skin = skin
        self._slots = np.split(np.arange(skin.slots), skin.first[1:-1])
        self._lenses = Lenses(
            skin.first,
            skin.link.astype(np.int64),
            skin.origin,
            skin.reach,
            skin.traits.limits,
            skin.traits.worth,
        )
        self._self_filter = SelfFilter(robot, skin)
        self.static_filter = StaticFilter(cell)
        self._ghosts, self._hanging = Ghosts(skin), Hanging(robot, skin)
        self._contacts, self._proof = Contacts(skin), Proof(skin)
        self._windows = DirtyWindows(skin)
        self._between = Between(skin, self._lenses, self._hanging)
        self.background = Background(cell.learned)
        self.reset()

    def reset(self) -> None:
        """Forget every frame."""
        S = self._skin.slots
        self._reports = Reports(
            np.zeros(S), np.zeros(S, dtype=np.uint8), np.zeros(S, dtype=np.uint8)
        )
        self._points = np.full((S, 3), np.nan)
        self._judged = no_judgement(S)
        self._judged.verdict[:] = Verdict.EMPTY
        self._stamp = np.full(self._skin.count, -np.inf)
        self._ghosts.reset()
        self._contacts.reset()
        self._windows.reset()
        self._proof.reset()

    @property
    def unable(self) -> NDArray[np.uint8]:
        """(K,) of `Unable`: what the frames themselves tell of their sensors."""
        blind = np.maximum(self._contacts.unable, self._proof.unable)
        return np.where(self._windows.dirty & (blind == SEES), DIRTY_WINDOW, blind)

    @property
    def doubted(self) -> NDArray[np.bool_]:
        """(S,) zones whose point a dirty window may have made of the body, believed or not."""
        return self._windows.doubted

    def add_frames(
        self,
        frames: Sequence[SensorFrame],
        posture: Posture,
        rules: Rules,
        qd: Array | None = None,
    ) -> None:
        """Judge `frames`, all measured at `posture`, where the arm moved with qd (n,) [rad/s] or
        stood; of two of one sensor the later one stays.

        A frame older than the one already held (reordered on its way) is ignored.
        """
        for group in self.foresee([Together(frames, posture, qd)], rules):
            self.take(group, rules)

    def foresee(self, groups: Sequence[Together], rules: Rules) -> list[Together]:
        """Let the self filter judge all `groups`, of which no two have a sensor in common, before
        `take` is handed each of those that are returned: without the frames that do not stay.
        """
        chosen = [Together(self._newest(g.frames), g.posture, g.qd) for g in groups]
        views = [View(_sensors(g.frames), g.posture, g.qd) for g in chosen if g.frames]
        if views:
            frames = [f for g in chosen for f in g.frames]
            slots = np.concatenate([self._slots[f.sensor] for f in frames])
            distance = corrected(self._skin, slots, np.concatenate([f.distance for f in frames]))
            self._self_filter.foresee(views, slots, distance, rules)
        return chosen

    def _newest(self, frames: Sequence[SensorFrame]) -> tuple[SensorFrame, ...]:
        """One of each sensor, none older than what is held."""
        newest = {f.sensor: f for f in frames if f.stamp >= self._stamp[f.sensor]}
        return tuple(newest.values())

    def take(self, group: Together, rules: Rules) -> None:
        """Take in a group that `foresee` returned; none without frames."""
        frames, posture = group.frames, group.posture
        if not frames:
            return
        sensors, first = _sensors(frames), self._lenses.first
        slots = np.concatenate([self._slots[f.sensor] for f in frames])
        reports, judged, points = self._reports, self._judged, self._points
        for f in frames:
            mine = slice(first[f.sensor], first[f.sensor + 1])
            reports.status[mine], reports.targets[mine] = f.status, f.targets
            self._stamp[f.sensor] = f.stamp
        self._self_filter.adopt(sensors, reports.distance, judged)
        place_points(sensors, posture.T_base_link, reports, self._lenses, judged.verdict, points)
        known = slots[self.static_filter.inside(points[slots])]
        judged.verdict[known[judged.verdict[known] == KEPT]] = STATIC
        if rules.doubts_hoses:
            self._hanging.mark(sensors, reports.distance, points, posture, judged)
        if rules.doubts_mixtures:
            self._doubt_mixtures(sensors, posture)
        if rules.doubts_windows:
            self._doubt_windows(sensors, posture)
        self._ghosts.mark_ghosts(sensors, reports.distance, judged, rules)
        if rules.feels_contact:
            self._contacts.mark(
                sensors, posture.T_base_link, reports, self._lenses, judged.verdict, points
            )  # fmt: skip
        self._proof.weigh(sensors, reports, self._lenses, judged)
        if self.background.learning:
            kept = slots[judged.verdict[slots] == KEPT]
            self.background.count_points(points[kept], frames[-1].stamp)

    def _doubt_mixtures(self, sensors: NDArray[np.intp], posture: Posture) -> None:
        """Take what is small or a hose, with the known cell behind, for the cell."""
        z, judged = self._reports.distance, self._judged
        thin = self._windows.doubtful(sensors, z, judged)
        if thin is not None:
            few = self._between.few(sensors, thin, z, judged.verdict)
            self._between.mark(
                sensors, thin, few, self._points, posture, judged, self.static_filter
            )  # fmt: skip

    def _doubt_windows(self, sensors: NDArray[np.intp], posture: Posture) -> None:
        """Doubt what a dirty window may have made of the body."""
        reports, judged = self._reports, self._judged
        thin = self._windows.doubtful(sensors, reports.distance, judged)
        drawn = None
        if thin is not None:
            # copied: those that surely have no body behind them are asked no further
            asked = self._between.few(sensors, thin, reports.distance, judged.verdict)
            drawn = self._self_filter.drawn(sensors, thin, reports.distance, judged)
            self._hanging.behind(sensors, thin, self._points, posture, FARTHEST, drawn)
            self._between.behind(
                sensors, asked, self._points, posture, judged, self.static_filter,
                self._windows.dirty, drawn,
            )  # fmt: skip
        sight = Sight(self._points, self._stamp, posture.T_base_link)
        self._windows.mark(sensors, drawn, sight, reports, self._lenses, judged.verdict)

    def newest(self) -> Cloud:
        """The cloud without regard to age, not copied: it changes with the next frames."""
        j = self._judged
        return Cloud(self._points, j.verdict, j.link, j.gap, j.eps, self._stamp)

    def view(self, now: float) -> Cloud:
        """The cloud as it is at `now` [s]: frames too old for their sensor are stale, but what
        touched a lens is not known to have left."""
        judged = self._judged
        verdict = judged.verdict.copy()
        old = now - self._stamp > self._skin.traits.oldest
        if old.any():
            rows = old[self._skin.sensor_of] & ~LASTING[verdict]
            verdict[rows] = Verdict.STALE
        return Cloud(
            points=freeze(self._points.copy()),
            verdict=freeze(verdict),
            link=freeze(judged.link.copy()),
            gap=freeze(judged.gap.copy()),
            eps=freeze(judged.eps.copy()),
            stamp=freeze(self._stamp.copy()),
        )


def _sensors(frames: Sequence[SensorFrame]) -> NDArray[np.intp]:
    return np.array([f.sensor for f in frames], dtype=np.intp)


def corrected(skin: Skin, slots: NDArray[np.intp], reported: Array) -> Array:
    """(n,) reported distances [m] in these slots, less what their zones are known to be off."""
    if skin.ranges is None:
        return reported
    scale = skin.depth[slots]  # walls were square to the axis
    return skin.ranges.corrected(slots, reported * scale) / scale
