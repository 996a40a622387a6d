"""The flat things that a calibration looks at: faces of the boxes and panels of a scene.

A scene shows things as they are; a cell is drawn larger than they are, so its boxes would not do.
A static body stands where the scene says, to what a tape measure is off; a movable one, a board
that somebody has put up, is somewhere near, and its place is found with the rest.
"""

from dataclasses import dataclass

import numpy as np

from app.errors import ConfigError
from app.messages import Array, freeze
from app.poses import transform
from app.world.scene import Scene
from app.world.world import Body

# [m], [rad] one sigma of a static face, such as the table top that the arm is bolted to
MEASURED = 0.001, float(np.radians(0.1))
PUT_UP = 0.03, float(np.radians(3.0))  # of a movable one
LEAST = 0.15  # [m] a narrower face only stands in the way
# turns from a box's axes to those of its faces, z out: (axis of the thickness, turns about x, y, z)
FACES = (
    (0, (0.0, np.pi / 2, 0.0)), (0, (0.0, -np.pi / 2, 0.0)),
    (1, (-np.pi / 2, 0.0, 0.0)), (1, (np.pi / 2, 0.0, 0.0)),
    (2, (0.0, 0.0, 0.0)), (2, (np.pi, 0.0, 0.0)),
)  # fmt: skip


@dataclass(frozen=True, eq=False, slots=True)
class Plane:
    """One face: T_base_plane (4, 4), its middle, z out of it; half (2,) [m] along its x and y.

    sigma: [m] and [rad], how far off it may be along z and about x and y.
    seen:  is it large enough to be measured to?
    """

    name: str
    T_base_plane: Array
    half: Array
    sigma: tuple[float, float]
    seen: bool


def planes_of(scene: Scene) -> tuple[Plane, ...]:
    """The faces of the scene's bodies; ConfigError where there is none to measure to."""
    planes = [p for body in scene.bodies if body.shape.dims for p in _faces(body)]
    if not any(p.seen for p in planes):
        raise ConfigError(
            f"scene {scene.name!r} has no box or panel that is {100 * LEAST:.0f} cm wide; add the "
            "table, a wall or a board as a [[body]], or give --scene calibration"
        )
    return tuple(planes)


def _faces(body: Body) -> list[Plane]:
    if body.shape.kind not in ("box", "panel"):
        return []
    size = np.array(body.shape.dims)
    T = body.motion.pose(0.0)
    out = []
    for axis, turns in FACES:
        face = transform(np.zeros(3), np.array(turns))
        face[:3, 3] = face[:3, 2] * size[axis] / 2
        half = np.abs(face[:3, :2].T @ size) / 2
        sigma = PUT_UP if body.movable else MEASURED
        seen = bool(2 * half.min() >= LEAST)
        out.append(Plane(body.name, freeze(T @ face), freeze(half), sigma, seen))
    return out
