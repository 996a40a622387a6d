"""The paper's Algorithm 1: which zones see the robot itself.

A ray is cast from the lens through each zone. Where it meets the robot's body near the
measured distance, the zone saw the robot; where the measurement lies well before the body, it
saw something in between. The tree of each link is built once in the link's own frame and
the rays are moved there. Rays against the sensor's own link and what is fixed to it, such as
the cover around the sensor, never change and are cast once.

Beyond the paper, and switchable back (`two_sided`, `footprint`):
- A point well BEHIND the body cannot be an obstacle; it is a wrong pose or multipath.
- A zone is a cone of 5.6 degrees, 10 cm wide at 1 m, and nobody knows to the tenth of a degree
  where it points. So rays are spread over it and beyond, by what its mounting and its stamp leave
  in doubt, and so is the distance at which the body may be seen. Otherwise edges of links pass as
  obstacles.

Distances are compared as the sensor reports them, along its axis or along its rays.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.perception.behind import aim_behind, find_body_behind
from app.perception.casting import (
    NEAR,
    Aims,
    Casts,
    Hulls,
    Views,
    aim,
    enter_boxes,
    first_look,
    second_look,
)
from app.perception.footprint import Fan, fan_of
from app.perception.returns import (
    Judgement,
    Returns,
    explain_returns,
    take_hits,
    take_judgement,
    take_own,
)
from app.perception.rules import Rules
from app.perception.uncertainty import Known, known_of, spreads_of_standing
from app.raycast import MISS, RigidMesh
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

USUAL = 0.3  # [m] how far a sensor's own link is away, for a first look at it


def no_judgement(slots: int) -> Judgement:
    """Room for the judgement of so many zones."""
    return Judgement(
        np.zeros(slots, dtype=np.uint8), np.full(slots, -1, dtype=np.int16),
        np.full(slots, np.inf), np.full(slots, np.nan), np.zeros(slots, dtype=np.bool_),
        Aims(*np.zeros((2, slots), dtype=np.uint8), *np.ones((2, slots))),
    )  # fmt: skip


class View(NamedTuple):
    """Sensors (m,) that measured at a posture, where the arm moved with qd (n,) [rad/s]; None: it
    stood."""

    sensors: NDArray[np.intp]
    posture: Posture
    qd: Array | None


class SelfFilter:
    """Judges the zones of some sensors at one posture; everything constant is kept.

    caution: times the margins that follow from what is known of the skin.
    """

    def __init__(self, robot: Robot, skin: Skin, caution: float = 1.0) -> None:
        self._meshes: tuple[RigidMesh, ...] = robot.rigid
        self._hulls, self.fan, self._known = _hulls(robot), fan_of(skin), known_of(skin, caution)
        self._own = _own_returns(robot, self.fan, self._known, self._hulls)
        links, shape = len(self._meshes), self._own.link.shape
        self._returns = Returns(np.empty(shape, np.float32), np.empty(shape, np.int16))
        self._casts = _room_for_casts(links, links * self._own.link.size)
        self._views = _room_for_views(links, skin.count)
        self._coming, self._reported = no_judgement(skin.slots), np.zeros(skin.slots)

    def judge(
        self,
        sensors: NDArray[np.intp],
        reported: Array,
        posture: Posture,
        rules: Rules,
        into: Judgement | None = None,
        qd: Array | None = None,
    ) -> Judgement:
        """Verdict of each zone of `sensors` (m,), and why, by slot.

        reported: (S,) [m] distances, any value where there is no target.   into: written and
        returned; rows of other sensors stay. Without it they are those of `no_judgement`.
        qd: (n,) [rad/s] at which the arm moved, None: it stood.
        """
        judged = no_judgement(len(reported)) if into is None else into
        self._aim(sensors, posture, qd)
        self._decide(sensors, reported, rules, judged)
        return judged

    def foresee(
        self, views: Sequence[View], slots: NDArray[np.intp], reported: Array, rules: Rules
    ) -> None:
        """Judge sensors that were at several postures in one go, none of them twice; `adopt` gives
        the judgement of each. A call for each posture costs more than most of them have to judge.

        reported: (n,) [m] distances of the zones in `slots` (n,).
        """
        for view in views:
            self._aim(*view)
        self._reported[slots] = reported
        sensors = np.concatenate([view.sensors for view in views])
        self._decide(sensors, self._reported, rules, self._coming)

    def adopt(self, sensors: NDArray[np.intp], distance: Array, judged: Judgement) -> None:
        """Write what was foreseen for `sensors` (m,): rows of `judged`, and of the distances (S,)
        [m] that it is for."""
        take_judgement(
            sensors, self.fan.first, self._reported, self._coming, distance, judged
        )  # fmt: skip

    def _aim(self, sensors: NDArray[np.intp], posture: Posture, qd: Array | None) -> None:
        twist = posture.link_twists(np.zeros(len(posture.q)) if qd is None else qd)
        aim(sensors, posture.T_base_link, twist, self.fan, self._hulls, self._views)

    def _decide(
        self, sensors: NDArray[np.intp], reported: Array, rules: Rules, judged: Judgement
    ) -> None:
        """Judge sensors from where they were last aimed."""
        fan, known, hulls, views = self.fan, self._known, self._hulls, self._views
        first_look(sensors, reported, rules.footprint, fan, hulls, known, views, judged.aims)
        self._look(sensors, reported, rules, judged)
        if rules.footprint and second_look(sensors, judged.verdict, fan, judged.aims):
            self._look(sensors, reported, rules, judged)

    def drawn(
        self, sensors: NDArray[np.intp], asked: NDArray[np.bool_], reported: Array,
        judged: Judgement,
    ) -> NDArray[np.int16]:  # fmt: skip
        """(S,) of which link a dirty window may have made the reports (S,) [m] of the `asked` zones
        (S,) of `sensors` (m,), which have just been judged, -1 for none; those that surely see
        something else are no longer asked."""
        fan, out = self.fan, np.full(len(asked), -1, dtype=np.int16)
        aim_behind(sensors, asked, fan, judged.aims)
        self._cast(sensors, judged.aims)
        find_body_behind(sensors, asked, reported, self._known, judged.aims, self._returns, out)
        return out

    def _look(
        self, sensors: NDArray[np.intp], reported: Array, rules: Rules, judged: Judgement
    ) -> None:
        """Cast the rays that are still to be cast, and judge by all."""
        self._cast(sensors, judged.aims)
        explain_returns(
            sensors, reported, rules, self.fan, self._known, self._hulls, self._returns, judged
        )

    def _cast(self, sensors: NDArray[np.intp], aims: Aims) -> None:
        """Cast the rays that are still to be cast."""
        fan, casts = self.fan, self._casts
        take_own(sensors, fan, aims, self._own, self._returns)
        enter_boxes(sensors, fan, self._hulls, self._views, aims, casts)
        first = 0
        for mesh, last in zip(self._meshes, casts.end.tolist(), strict=True):
            if last > first:
                t = mesh.cast(casts.origin[first:last], casts.direction[first:last])
                np.add(t, np.float32(NEAR), out=casts.hit[first:last])
            first = last
        take_hits(self._known.sensor_of, fan, aims, casts, self._returns)


def _own_returns(robot: Robot, fan: Fan, known: Known, hulls: Hulls) -> Returns:
    """Where rays end on each sensor's own link and what is fixed to it, spread as widely as the
    body is near."""
    shape = (len(fan.centre), fan.offset.shape[1])
    own = Returns(np.full(shape, MISS), np.full(shape, -1, np.int16))
    for k in range(len(fan.link)):
        mine = slice(fan.first[k], fan.first[k + 1])
        away = np.full(fan.first[k + 1] - fan.first[k], USUAL)
        wide = np.empty_like(away)
        for _ in range(2):
            spreads_of_standing(known, k, away, wide)
            distance, link = _fixed_hits(robot, fan, hulls, k, wide)
            nearest = distance.min(axis=1)
            away = np.where(np.isfinite(nearest), nearest, USUAL).astype(np.float64)
        own.distance[mine], own.link[mine] = distance, link
    return own


def _fixed_hits(
    robot: Robot, fan: Fan, hulls: Hulls, k: int, wide: Array
) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
    """Distances (n, R) that sensor k would report of what is fixed to it, and its links (n, R).

    wide: (n,) spread of its zones. What goes round the lens goes aside with it: no more than the
    zone itself is looked at on a cover.
    """
    mount, mine = int(fan.link[k]), slice(fan.first[k], fan.first[k + 1])
    shape = (len(wide), fan.offset.shape[1])
    distance, link = np.full(shape, MISS), np.full(shape, -1, np.int16)
    for i in np.flatnonzero(hulls.fixed[mount]):
        s = np.ones_like(wide) if robot.links[i] in robot.covers else wide
        rays = (
            fan.centre[mine, None]
            + s[:, None, None] * fan.offset[k, :, :1] * fan.across[mine, None]
            + s[:, None, None] * fan.offset[k, :, 1:] * fan.down[mine, None]
        )
        length = np.linalg.norm(rays, axis=2)
        T = robot.T_link_link(int(i), mount)  # a fixed part may have another frame
        d = ((rays / length[..., None]).reshape(-1, 3) @ T[:3, :3].T).astype(np.float32)
        o = (T[:3, :3] @ fan.origin[k] + T[:3, 3]).astype(np.float32) + np.float32(NEAR) * d
        t = robot.rigid[i].cast(o, d).reshape(shape) + np.float32(NEAR)
        t = t if fan.radial[k] else (t / length).astype(np.float32)
        link[t < distance] = i
        distance = np.minimum(distance, t)
    return distance, link


def _room_for_casts(links: int, most: int) -> Casts:
    return Casts(
        origin=np.empty((most, 3), dtype=np.float32),
        direction=np.empty((most, 3), dtype=np.float32),
        zone_ray=np.empty(most, dtype=np.int32),
        hit=np.empty(most, dtype=np.float32),
        end=np.empty(links, dtype=np.int64),
    )


def _room_for_views(links: int, sensors: int) -> Views:
    shape = (links, sensors)
    return Views(
        R_link_mount=np.empty((*shape, 3, 3)),
        lens=np.empty((*shape, 3)),
        twist=np.empty((*shape, 6)),
        reached=np.empty(shape, dtype=np.bool_),
    )


def _hulls(robot: Robot) -> Hulls:
    """Spheres, boxes and the thresholds that were measured."""
    used = [b.vertices[np.unique(b.faces)] for b in robot.bodies]
    return Hulls(
        centre=np.array([m.centre for m in robot.rigid]),
        radius=np.array([m.radius for m in robot.rigid]) * (1.0 + 1e-6),  # float32 meshes
        low=np.array([v.min(axis=0) for v in used]),
        high=np.array([v.max(axis=0) for v in used]),
        fixed=robot.welded,
        measured=robot.eps,
        slack=np.array([np.nanmax(robot.eps, initial=0.0)]),
    )
