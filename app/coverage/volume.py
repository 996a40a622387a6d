"""The space round the arm in voxels: what of it some sensor watches.

Near is what lies up to 0.5 m from the surface, far what lies from there up to 2 m; both above
the floor on which the arm stands, and outside the arm. Two published measures come along:

- *sensed share* (Kumar and Sahin 2019): of the volume round the arm, what is within the view of
  a sensor, here up to 2 m and with what the arm hides taken off;
- *occupancy coverage* (after Rozlivek et al. 2023): of its voxels, those that a measurement
  would tell to be free or taken in an empty room, which are those that the middle ray of a zone
  passes through.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.compiled import compiled
from app.coverage.cones import COLUMNS, EDGES, RADIAL, ROWS, SIZE, packed
from app.coverage.look import Look, Subject
from app.messages import Array

NEAR, FAR = 0.5, 2.0  # [m] from the surface
FINE, COARSE = 0.05, 0.1  # [m] voxels of the near and of the far space
ROUGH = 4  # one in so many patches tells how far a voxel of the far space is
FLOOR = 0.0  # [m] z of the base frame, below which nothing is counted


class Space(NamedTuple):
    """Shares of the space round the arm at one posture.

    blind_near, blind_far: of what no sensor watches.   sensed, occupancy: see the module.
    unwatched: (n, 3) [m] middles of the near voxels that nobody watches, base frame.
    """

    blind_near: float
    blind_far: float
    sensed: float
    occupancy: float
    unwatched: Array


def space(subject: Subject, look: Look) -> Space:
    """What is watched of the space round the arm."""
    eyes = packed(subject.cones, look.views.free)
    near, (every, distance) = voxels(look, FINE, NEAR)[0], voxels(look, COARSE, FAR, ROUGH)
    apart = every[distance > NEAR]
    seen = [watched(v, look.T_base_sensor, eyes).any(axis=0) for v in (near, apart)]
    parts = np.array([len(near) * FINE**3, len(apart) * COARSE**3])
    share = np.array([s.mean() for s in seen])
    return Space(
        1.0 - float(share[0]), 1.0 - float(share[1]), float(share @ parts / parts.sum()),
        _occupancy(subject, look, every), near[~seen[0]],
    )  # fmt: skip


def voxels(look: Look, size: float, most: float, stride: int = 1) -> tuple[Array, Array]:
    """(n, 3) [m] middles of the voxels up to `most` from the arm, outside it, and (n,) [m] how far
    they are from it, by every so many of the patches."""
    points, normals = look.at.point[::stride], look.at.normal[::stride]
    low = np.floor((points.min(axis=0) - most) / size)
    high = np.ceil((points.max(axis=0) + most) / size)
    low[2] = max(low[2], np.ceil(FLOOR / size))
    axes = [(np.arange(a, b) + 0.5) * size for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distance, patch = map(np.asarray, KDTree(points).query(grid, distance_upper_bound=most))
    some = np.isfinite(distance)
    grid, patch, distance = grid[some], patch[some], distance[some]
    outside = np.einsum("ni,ni->n", grid - points[patch], normals[patch]) > 0.0
    return np.ascontiguousarray(grid[outside]), distance[outside]


@compiled
def watched(points: Array, T_base_sensor: Array, eyes: Array) -> NDArray[np.bool_]:
    """(K, n) does a sensor see a small thing at points (n, 3), base frame?

    eyes: (K, E) see `app.coverage.cones.packed`.
    """
    out = np.zeros((len(T_base_sensor), len(points)), dtype=np.bool_)
    for k in range(len(T_base_sensor)):
        T, eye = T_base_sensor[k], eyes[k]
        n, columns, rows = int(eye[SIZE]), int(eye[COLUMNS]), int(eye[ROWS])
        down = EDGES + n + 1
        for p in range(len(points)):
            a, b, c = points[p, 0] - T[0, 3], points[p, 1] - T[1, 3], points[p, 2] - T[2, 3]
            z = T[0, 2] * a + T[1, 2] * b + T[2, 2] * c
            if z <= 0.0:
                continue
            x = (T[0, 0] * a + T[1, 0] * b + T[2, 0] * c) / z
            y = (T[0, 1] * a + T[1, 1] * b + T[2, 1] * c) / z
            if not (eye[EDGES] <= x <= eye[EDGES + columns] and eye[down] <= y <= eye[down + rows]):
                continue
            i, j = 0, 0
            while i < columns - 1 and x > eye[EDGES + i + 1]:
                i += 1
            while j < rows - 1 and y > eye[down + j + 1]:
                j += 1
            reported = np.sqrt(a * a + b * b + c * c) if eye[RADIAL] > 0.0 else z
            out[k, p] = reported < eye[down + n + 1 + i * n + j]
    return out


def _occupancy(subject: Subject, look: Look, every: Array) -> float:
    """The occupancy coverage of `every` voxel of the size `COARSE`."""
    skin = subject.skin
    R = look.T_base_sensor[skin.sensor_of, :3, :3]
    R_link = subject.cones.T_link_sensor[skin.sensor_of, :3, :3]
    reach = np.einsum("sij,skj,sk->si", R, R_link, skin.reach)  # into the sensor's axes, and on
    step = np.arange(0.5, FAR / COARSE * 2.0)[:, None] * COARSE / 2.0  # (steps, 1)
    at = look.T_base_sensor[skin.sensor_of, :3, 3] + step[..., None] * reach
    told = at[step < look.views.free]
    cells = np.floor(every / COARSE).astype(np.int64)
    low = cells.min(axis=0)
    size = cells.max(axis=0) - low + 1
    marked = np.floor(told / COARSE).astype(np.int64) - low
    marked = marked[((marked >= 0) & (marked < size)).all(axis=1)]
    taken = np.zeros(size, dtype=bool)
    taken[tuple(marked.T)] = True
    return float(taken[tuple((cells - low).T)].mean())
