"""Which postures tell most: random safe ones, chosen one after another.

The unknowns of a sensor are known to the covariance C = S^-1, S the sum over all looks of their
information with the zones' shares eliminated (`app.calibration.solver`). The next posture is the
one that lowers the sum of the variances, in units of what is wanted, most for each second that it
takes to get there and to look.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.calibration.fit import Fitter
from app.calibration.model import POSE
from app.calibration.planes import Plane
from app.calibration.views import Path, Views
from app.cell.parts import Box, Cell
from app.control.clearance import Clearance
from app.errors import ConfigError
from app.messages import Array, freeze
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.world.scene import Scene

CLEAR, APART = 0.006, 0.02  # [m] kept from the cell, beside its margins, and between links
BOARD = 0.06  # [m] margin round what somebody has put up
POOL = 260  # postures to choose from
CLEAN, DRAWN = 2000, 20_000  # clear ones that these are taken of; drawn for that at most
NEAR, FACING = (0.12, 0.45), 0.6  # [m] and cosine: a look that tells shift from share
ASKED = 60  # of the pool, for each choice
STEP = 0.06  # [rad] between two looks along a way
WANTED = np.array([5e-4] * 3 + [float(np.radians(0.1))] * 3)
FRAMES = 10.0  # of a look
BENDS = 2.0  # [rad/s^2] of the way from one posture to the next


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """Postures q (m, n) in their order, the first where the arm begins; seconds it takes."""

    q: Array
    seconds: float


def with_boards(scene: Scene) -> Cell:
    """The scene's cell, with what may be moved as boxes of it."""
    boards = [
        Box(b.name, b.motion.pose(0.0), freeze(np.array(_extent(b.shape.vertices)) + 2 * BOARD))
        for b in scene.bodies if b.movable
    ]  # fmt: skip
    return Cell(scene.cell.title, (*scene.cell.boxes, *boards), scene.cell.planes)


def _extent(vertices: Array) -> Array:
    return np.asarray(np.ptp(vertices, axis=0))


def travel_time(way: Array, speed: float) -> float:
    """[s] from rest to rest over `way` (n,) [rad], the fastest joint at `speed` at most."""
    far = float(np.abs(way).max())
    if far * BENDS < speed**2:
        return 2 * float(np.sqrt(far / BENDS))
    return far / speed + speed / BENDS


class Planner:
    """Chooses postures for a skin among planes."""

    def __init__(
        self, robot: Robot, skin: Skin, planes: tuple[Plane, ...], cell: Cell, seed: int
    ) -> None:
        self.robot, self.skin, self.planes = robot, skin, planes
        self._clearance = Clearance(robot, cell)
        self._rng = np.random.default_rng([seed, 0x6D])
        links = np.unique(skin.link)
        self._turns = robot.supports[links].any(axis=0)

    def plan(self, start: Array, seconds: float, speed: float, rest: float) -> Plan:
        """Postures from `start` (n,) that take at most `seconds`; `rest` [s] in each."""
        pool = np.array([start, *self._pool(start)])
        if len(pool) < 2:
            raise ConfigError(
                "no posture here is clear of the cell and of the arm itself; give a --scene with "
                "more room around the arm"
            )
        A, E, D = self._information(pool)
        chosen, spent = [0], rest
        S_A, S_E, S_D = A[0].copy(), E[0].copy(), D[0] + self._zone_prior
        left = set(range(1, len(pool)))
        while left:
            here = pool[chosen[-1]]
            asked = self._rng.permutation(list(left))[:ASKED]
            takes = np.array([travel_time(pool[i] - here, speed) + rest for i in asked])
            before = self._cost(S_A[None], S_E[None], S_D[None])[0]
            gain = before - self._cost(S_A + A[asked], S_E + E[asked], S_D + D[asked])
            for n in np.argsort(-gain / takes):
                i = int(asked[n])
                if spent + takes[n] <= seconds and self._free(here, pool[i]):
                    break
            else:
                if spent + takes.min() > seconds or len(asked) == len(left):
                    break
                continue
            chosen.append(i)
            left.discard(i)
            spent += float(takes[n])
            S_A, S_E, S_D = S_A + A[i], S_E + E[i], S_D + D[i]
        return Plan(freeze(pool[chosen]), spent)

    def _pool(self, start: Array) -> Array:
        """(m, n) postures that are clear, half of them such that every sensor is often near
        something; joints that move no sensor stay where they are."""
        r, found, near = self.robot, [], []
        low, high = np.maximum(r.q_min, -np.pi), np.minimum(r.q_max, np.pi)
        for _ in range(DRAWN):
            q = np.where(self._turns, self._rng.uniform(low, high), start)
            if self._clear(q):
                found.append(q)
                near.append(self._near(r.posture(q)))
            if len(found) == CLEAN:
                break
        if not found:
            return np.empty((0, r.n))
        looks, counts, taken = np.array(near, dtype=np.float64), np.zeros(self.skin.count), []
        for _ in range(min(POOL, len(found)) // 2):
            best = int(np.argmax(looks @ (1.0 / (1.0 + counts))))
            counts += looks[best]
            looks[best] = 0.0
            taken.append(best)
        rest = [i for i in range(len(found)) if i not in set(taken)][: POOL - len(taken)]
        return np.array(found)[taken + rest]

    def _near(self, posture: Posture) -> NDArray[np.bool_]:
        """(K,) does a sensor look at a face that is near, along its axis and about square?"""
        skin, T = self.skin, posture.T_base_link[self.skin.link]
        lens = np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin) + T[:, :3, 3]
        axis = np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
        out = np.zeros(skin.count, dtype=np.bool_)
        for p in self.planes:
            P = p.T_base_plane
            cosine = -axis @ P[:3, 2]
            t = ((lens - P[:3, 3]) @ P[:3, 2]) / np.maximum(cosine, 1e-6)
            there = np.abs((lens + t[:, None] * axis - P[:3, 3]) @ P[:3, :2])
            ahead = (cosine > FACING) & (t > NEAR[0]) & (t < NEAR[1])
            out |= p.seen & ahead & (there < p.half).all(axis=1)
        return out

    def _clear(self, q: Array) -> bool:
        gaps = self._clearance.measure(self.robot.posture(q), CLEAR, APART)
        return len(gaps.distance) == 0

    def _free(self, a: Array, b: Array) -> bool:
        """Is the straight way clear?"""
        steps = int(np.ceil(np.abs(b - a).max() / STEP)) + 1
        return all(self._clear(a + (b - a) * s) for s in np.linspace(0.0, 1.0, steps)[1:])

    @property
    def _zone_prior(self) -> float:
        return float(self.skin.doubt.share.max() ** -2)

    def _information(self, pool: Array) -> tuple[Array, Array, Array]:
        """A (C, K, 6, 6), E (C, K, Z, 6) and D (C, K, Z) of each posture."""
        K, C = self.skin.count, len(pool)
        Z = int(np.diff(self.skin.first).max())
        views = Views(
            np.tile(np.arange(K), C), np.zeros(C * K), np.zeros(C * K, dtype=bool),
            np.repeat(pool, K, axis=0), np.ones((C * K, Z)), np.full((C * K, Z), FRAMES),
        )  # fmt: skip
        path = Path(np.array([0.0, 1.0]), pool[:2])
        fit, said = Fitter(self.robot, self.skin, self.planes, views, path).expected()
        rows, weight = fit.rows, fit.weight
        at = rows.view  # a view is a posture and a sensor
        A, E = np.zeros((C * K, POSE, POSE)), np.zeros((C * K, Z, POSE))
        D = np.zeros((C * K, Z))
        J = said.pose[:, :POSE]  # windows are clean
        WJ = J * weight[:, None]
        np.add.at(A, at, WJ[:, :, None] * J[:, None, :])
        E[at, rows.zone] = WJ * said.zone[:, None]
        D[at, rows.zone] = weight * said.zone**2
        return A.reshape(C, K, POSE, POSE), E.reshape(C, K, Z, POSE), D.reshape(C, K, Z)

    def _cost(self, A: Array, E: Array, D: Array) -> Array:
        """(C,) sums of the variances in units of what is wanted."""
        doubt = self.skin.doubt
        prior = np.concatenate(
            (np.repeat(doubt.position[:, None], 3, 1), np.repeat(doubt.angle[:, None], 3, 1)), 1
        )
        S = A - np.swapaxes(E / D[..., None], -1, -2) @ E
        S = S + prior[:, :, None] ** -2 * np.eye(POSE)
        variance = np.diagonal(np.linalg.inv(S), axis1=-2, axis2=-1)
        return np.asarray((variance / WANTED**2).sum(axis=(-1, -2)))
