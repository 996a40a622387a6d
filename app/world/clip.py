"""A person who moves as a motion file says, again and again, as a pure function of time.

A clip that ends elsewhere than it began is walked to and fro: at its end the person turns round
on the spot while the last posture becomes the first one, and goes back in the same way. One that
ends where it began is played again after the same short transition.
"""

from pathlib import Path

import numpy as np

from app.errors import WorldError
from app.messages import Array, freeze
from app.world.bones import Limbs, limbs_of
from app.world.build import FLOOR
from app.world.bvh import load_bvh
from app.world.limbs import capsule_poses, rotated
from app.world.person import PartMotion
from app.world.route import smoothstep
from app.world.shapes import capsule
from app.world.world import Body

SEAM = 1.2  # s, in which the last posture becomes the first one
AWAY = 0.5  # m: who ends farther from the beginning turns round
THINNEST = 1e-3  # m, length of a capsule without one


class Clip:
    """A clip at a person's size, standing on the floor, and where in the scene it is played."""

    def __init__(self, path: Path, stature: float, at: Array, heading: float, start: float) -> None:
        """stature: [m].   at: (2,) [m] where it begins, base frame.   heading: [rad] to which it
        looks at first.   start: 0..1 of a round at time zero."""
        skeleton = load_bvh(path)
        limbs = limbs_of(skeleton)
        if not limbs.names or not limbs.stature > 0.0:
            raise WorldError(f"clip {path}: it has no bones; export a skeleton with offsets")
        self.names, self.colours = limbs.names, limbs.colours
        self.radius = limbs.radius * stature
        ends = limbs.ends * (stature / limbs.stature)
        ends[..., 2] += FLOOR - (ends[..., 2] - self.radius[:, None]).min()
        self._root = ends[:, 0].mean(axis=1)[:, :2]  # over the ground
        self._heading = _headings(limbs, len(ends))
        self._local = _in_own_frame(ends, self._root, self._heading)
        self.length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).mean(axis=0)
        self.length = np.maximum(self.length, THINNEST)
        self._frame_time = skeleton.frame_time
        self._at, self._first = np.asarray(at), heading
        self._place()
        self._start = start * self.period
        self._last: tuple[float, dict[str, Array]] = (np.nan, {})

    def _place(self) -> None:
        """Begin at the place and in the heading that were asked for."""
        R = rotated(self._first - self._heading[0])[:2, :2]
        self._root = (self._root - self._root[0]) @ R.T + self._at
        self._heading = self._heading - self._heading[0] + self._first
        self._away = bool(np.linalg.norm(self._root[-1] - self._root[0]) > AWAY)
        self._playing = self._frame_time * (len(self._root) - 1)
        self.period = (self._playing + SEAM) * (2 if self._away else 1)  # [s] of a whole round

    def poses(self, t: float) -> dict[str, Array]:
        """T_base_part (4, 4) of every part by name, at `t` [s]."""
        stamp, poses = self._last
        if t != stamp:
            poses = dict(zip(self.names, capsule_poses(self.ends(t)), strict=True))
            self._last = (t, poses)
        return poses

    def ends(self, t: float) -> Array:
        """Ends (n, 2, 3) [m] of all capsules, base frame."""
        back, t = divmod((t + self._start) % self.period, self._playing + SEAM)
        local, root, heading = self._played(t) if t < self._playing else self._seam(t)
        if back:  # from where the way out has ended, turned by half a turn
            root, heading = self._root[0] + self._root[-1] - root, heading + np.pi
        out: Array = local @ rotated(heading).T
        out[..., :2] += root
        return out

    def _played(self, t: float) -> tuple[Array, Array, float]:
        """Posture in the person's own frame, place and heading at `t` [s] into the clip."""
        x = t / self._frame_time if self._playing else 0.0
        i = min(int(x), len(self._root) - 1)
        j, share = min(i + 1, len(self._root) - 1), x - i
        local = (1 - share) * self._local[i] + share * self._local[j]
        root = (1 - share) * self._root[i] + share * self._root[j]
        return local, root, float((1 - share) * self._heading[i] + share * self._heading[j])

    def _seam(self, t: float) -> tuple[Array, Array, float]:
        """From the last posture to the first one, at its place or turned round."""
        share = smoothstep((t - self._playing) / SEAM)
        local = (1 - share) * self._local[-1] + share * self._local[0]
        ended, first = float(self._heading[-1]), float(self._heading[0])
        turn = first + (np.pi if self._away else 0.0) - ended
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        to = self._root[-1] if self._away else self._root[0]
        root = (1 - share) * self._root[-1] + share * to
        return local, root, ended + share * turn


def clip_bodies(name: str, clip: Clip) -> list[Body]:
    """The capsules of a played clip, named like `person/chest`; nobody can drag them."""
    return [
        Body(
            f"{name}/{part}", capsule(float(radius), float(length)), colour,
            PartMotion(clip, part), False,
        )
        for part, radius, length, colour in zip(
            clip.names, clip.radius, clip.length, clip.colours, strict=True
        )
    ]  # fmt: skip


def _headings(limbs: Limbs, frames: int) -> Array:
    """Where the person looks [rad about z], (F,), without jumps; 0 where nobody can tell."""
    if limbs.lateral is None:
        return np.zeros(frames)
    left = limbs.lateral
    return np.unwrap(np.arctan2(-left[:, 0], left[:, 1]))


def _in_own_frame(ends: Array, root: Array, heading: Array) -> Array:
    """Ends (F, n, 2, 3) as seen from over the root, looking ahead."""
    c, s = np.cos(heading), np.sin(heading)
    R = np.zeros((len(heading), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = c
    R[:, 0, 1], R[:, 1, 0], R[:, 2, 2] = -s, s, 1.0
    away = ends.copy()
    away[..., :2] -= root[:, None, None]
    return freeze(np.einsum("fnei,fij->fnej", away, R))
