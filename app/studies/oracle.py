"""The oracle: a perception that knows everything near, and when, without error.

What a controller touches with it no perception could have spared it; what it touches only
without it is perception's. Studies give it to a brain; nothing else can.

The world's surfaces are sampled once, `SPACING` apart, and carried along with their bodies.
Everything else is as with sensors: the same search for pairs, of the same number a link. The
speed of a point is that of its body, from its poses at this tick and the last.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.cell.learned import NOTHING_LEARNED, Learned
from app.cell.parts import Cell
from app.config import Params
from app.errors import StudyError
from app.judge.sampling import surface_points
from app.messages import Array, Cloud, JointState, Pairs, SensorFrame, Verdict, freeze
from app.needs import Needs
from app.perception.background import Background
from app.perception.perception import REACH, Lap, Percept
from app.perception.proximity import BodyPairs, ManyPairs
from app.perception.velocity import LEAST_SPEED, MOST
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.world.shapes import Shape
from app.world.world import World

SPACING = 0.03  # [m] a plane at d is told to be at most sqrt(d^2 + SPACING^2) away


class TruePerception:
    """Perceives `world` as it is at each tick, but for the bodies of the known cell; only for
    controllers that want several pairs."""

    def __init__(self, robot: Robot, skin: Skin, world: World, cell: Cell | None = None) -> None:
        leave_out = [b.name for b in cell.boxes] if cell else ()
        self._robot, self._skin, self._world = robot, skin, world
        shapes = world.shapes()
        self._rows = [i for i, name in enumerate(shapes) if name not in leave_out]
        shapes_near = [shape for name, shape in shapes.items() if name not in leave_out]
        samples = [_samples(shape) for shape in shapes_near]
        self._local = [np.column_stack((s, np.ones(len(s)))) for s in samples]
        self._body_of = np.repeat(np.arange(len(samples)), [len(s) for s in samples])
        self._body = BodyPairs(robot)
        self._many = ManyPairs(self._body)
        self.background = Background(NOTHING_LEARNED)
        self.unable = np.zeros(skin.count, dtype=np.uint8)
        self.reset()

    def know(self, learned: Learned) -> None:
        """What is learned of the cell is no news."""

    def reset(self) -> None:
        """Forget the last tick."""
        self._T: Array | None = None  # (m, 4, 4) bodies' poses of the last tick
        self.begin_anew()

    def begin_anew(self) -> None:
        """Choose the pairs anew."""
        self._body.reset()
        self._many.reset()

    def update(
        self,
        frames: Sequence[SensorFrame],
        joints: JointState,
        posture: Posture,
        params: Params,
        needs: Needs,
        dt: float,
        lap: Lap,
    ) -> Percept:
        """The truth; `frames` are not looked at."""
        if needs.pairs != "several":
            raise StudyError(f"the oracle finds several pairs a link, not {needs.pairs!r}")
        T = self._poses()
        points = self._points(T)
        use = np.ones(len(points), dtype=bool)
        body = self._body.search(points, use, posture)
        pairs = self._many.update(body, points, use, posture, REACH, joints.stamp)
        unsure = freeze(np.where(pairs.slot >= 0, 0.0, np.inf))  # of nothing that is there
        approach = freeze(self._approach(pairs, T, dt))
        pairs = replace(pairs, approach=approach, sigma=unsure, age=unsure)
        self._T = T
        lap("pairs")
        return self._percept(posture, pairs, body, joints.stamp)

    def recall(self, joints: JointState, params: Params) -> Percept:
        """What is near the present posture."""
        posture, points = self._robot.posture(joints.q), self._points(self._poses())
        body = self._body.search(points, np.ones(len(points), dtype=bool), posture)
        return self._percept(posture, body, body, joints.stamp)

    def _poses(self) -> Array:
        """(m, 4, 4) of the bodies now."""
        poses = self._world.poses()
        return np.array([poses[i].T_base_body for i in self._rows]).reshape(-1, 4, 4)

    def _points(self, T: Array) -> Array:
        """(n, 3) [m] of all bodies, base frame."""
        placed = [local @ t[:3].T for local, t in zip(self._local, T, strict=True)]
        return np.concatenate(placed) if placed else np.empty((0, 3))

    def _approach(self, pairs: Pairs, T: Array, dt: float) -> Array:
        """(B,) [m/s] at which each pair's point comes, within what a perception would say."""
        out = np.zeros(len(pairs.slot))
        if self._T is None:
            return out
        seen = np.flatnonzero(pairs.slot >= 0)
        body = self._body_of[pairs.slot[seen]]
        world = np.column_stack((pairs.on_world[seen], np.ones(len(seen))))
        motion = (T - self._T) @ np.linalg.inv(T) / dt
        velocity = np.einsum("kij,kj->ki", motion[body], world)[:, :3]
        speed = np.einsum("ki,ki->k", velocity, pairs.normal[seen])
        out[seen] = np.clip(speed, LEAST_SPEED, MOST)
        return out

    def _percept(self, posture: Posture, pairs: Pairs, body: Pairs, now: float) -> Percept:
        S, K = self._skin.slots, self._skin.count
        nothing = Cloud(
            points=freeze(np.full((S, 3), np.nan)),
            verdict=freeze(np.full(S, Verdict.EMPTY, dtype=np.uint8)),
            link=freeze(np.full(S, -1, dtype=np.int16)),
            gap=freeze(np.full(S, np.inf)),
            eps=freeze(np.full(S, np.nan)),
            stamp=freeze(np.full(K, now)),
        )
        return Percept(posture, nothing, pairs, pairs, body, np.empty((0, 3)))


def _samples(shape: Shape) -> Array:
    return surface_points(shape.vertices, shape.faces, SPACING)
