"""Which known surface each zone looks at, as far as that is sure, and how it lies there.

A zone counts only when its centre and the corners of a square somewhat larger than it meet one
surface: what lies on an edge, or so near it that a mounting error moves it there, tells little and
misleads much. A face of the scene is a plane. Another link of the arm is taken for one over a
zone's width, through the places where those five rays meet it; its height is that of the mean over
the zone. For a surface that is quadratic across the zone (half width w) the mean is

    z = z_0 + (z_corners - z_0) / (3 m^2)         corners at m w,  mean of x^2 + y^2 = 2 w^2 / 3
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.calibration.planes import Plane
from app.messages import Array
from app.raycast import Beams, Solids, no_hits
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin, zone_directions

MARGIN = 1.35  # corners that are looked at lie so much farther out than a zone's own
BENT = 0.004  # [m] a link that is more curved across a zone is no plane
NOTHING = -1  # a zone that tells nothing; a face of the scene has its own number
FIRST_LINK = -2  # a body link l has the number FIRST_LINK - l
GRAZING = 0.05  # cosine: a face is met at less of a slant, or not at all
AIR = -2  # label of a ray that meets no link


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """What m sensors see with Z zones each, base frame.

    target: (m, Z) face of the scene, NOTHING, or FIRST_LINK - l.
    normal: (m, Z, 3) unit, towards the sensor.   height: (m, Z) [m] along it.
    bent:   (m, Z) [m] how far the surface leaves that plane within a zone.
    """

    target: NDArray[np.int32]
    normal: Array
    height: Array
    bent: Array


class Surroundings:
    """The robot's own links and the faces of a scene, as the sensors of `skin` are believed to see
    them."""

    def __init__(self, robot: Robot, skin: Skin, planes: tuple[Plane, ...]) -> None:
        self.robot, self.skin, self.planes = robot, skin, planes
        self.zones = int(np.diff(skin.first).max())
        self._links = Solids(robot.rigid, np.arange(len(robot.rigid), dtype=np.int16))
        self._u = np.tile([0.0, 0.0, 1.0], (skin.count, self.zones, 5, 1))
        for k, sensor in enumerate(skin.sensors):
            kind = sensor.type
            row, column = np.divmod(np.arange(kind.zones, dtype=np.float64), kind.columns)
            a = MARGIN / 2
            for i, (down, across) in enumerate(((0, 0), (-a, -a), (-a, a), (a, a), (a, -a))):
                self._u[k, : kind.zones, i] = zone_directions(sensor, row + down, column + across)
        length = np.linalg.norm(self._u, axis=3, keepdims=True)
        self._way = self._u / length
        self._half_angle = np.arccos(self._way[..., 2].min(axis=(1, 2)).clip(-1.0, 1.0))

    @cached_property
    def own(self) -> NDArray[np.bool_]:
        """(K, Z) zones in whose way lies what moves as one with their sensor, at all times."""
        every = np.arange(self.skin.count)
        posture = self.robot.posture(self.robot.home)
        T = posture.T_base_link[self.skin.link] @ self._laid_out
        label = self._cast(every, posture, T, ~self.robot.welded[self.skin.link])[1]
        return np.asarray((label != AIR).any(axis=2))

    @property
    def _laid_out(self) -> Array:
        return np.array([s.T_link_sensor for s in self.skin.sensors])

    def look(
        self, sensors: NDArray[np.intp], posture: Posture, T_base_sensor: Array, T_plane: Array
    ) -> Seen:
        """What `sensors` (m,) at T_base_sensor (m, 4, 4) see; T_plane: (P, 4, 4) the faces now."""
        blind = self.robot.welded[self.skin.link[sensors]]
        length, label, way = self._cast(sensors, posture, T_base_sensor, blind)
        m, Z = len(sensors), self.zones
        lens = T_base_sensor[:, :3, 3]
        distance, face = self._faces(lens, way.reshape(m, -1, 3), T_plane)
        distance, face = distance.reshape(m, Z, 5), face.reshape(m, Z, 5)
        one_face = (face >= 0) & (distance < length)
        target = np.full((m, Z), NOTHING, dtype=np.int32)
        plane = one_face.all(axis=2) & (face == face[..., :1]).all(axis=2)
        plane &= np.array([p.seen for p in self.planes])[face[..., 0]]
        target[plane] = face[..., 0][plane]
        link = (label >= 0).all(axis=2) & (label == label[..., :1]).all(axis=2)
        link &= (length < distance).all(axis=2)
        normal, height = np.zeros((m, Z, 3)), np.zeros((m, Z))
        n = T_plane[:, :3, 2]
        normal[plane] = n[target[plane]]
        height[plane] = (n * T_plane[:, :3, 3]).sum(axis=1)[target[plane]]
        bent = np.zeros((m, Z))
        i, z = np.nonzero(link)
        points = lens[i, None] + length[i, z, :, None] * way[i, z]
        normal[i, z], height[i, z], bent[i, z] = _tangent(points, lens[i])
        target[i, z] = np.where(bent[i, z] < BENT, FIRST_LINK - label[i, z, 0], NOTHING)
        target[self.own[sensors]] = NOTHING
        return Seen(target, normal, height, bent)

    def _cast(
        self, sensors: NDArray[np.intp], posture: Posture, T: Array, blind: NDArray[np.bool_]
    ) -> tuple[Array, NDArray[np.int16], Array]:
        """Length [m] and link of rays (m, Z, 5), and their directions (m, Z, 5, 3), base frame."""
        m, rays = len(sensors), self.zones * 5
        way = np.einsum("mij,mzrj->mzri", T[:, :3, :3], self._way[sensors])
        beams = Beams(
            np.ascontiguousarray(T[:, :3, 3]), np.ascontiguousarray(T[:, :3, 2]),
            self._half_angle[sensors], np.arange(m + 1, dtype=np.int64) * rays,
            np.ascontiguousarray(way.reshape(-1, 3)),
        )  # fmt: skip
        far = np.repeat([self.skin.sensors[k].type.most_m for k in sensors], rays)
        hits = no_hits(far.astype(np.float32), AIR)
        self._links.end_rays(
            np.array(posture.T_base_link), beams, np.ascontiguousarray(blind), hits
        )
        shape = m, self.zones, 5
        return hits.length.reshape(shape).astype(np.float64), hits.label.reshape(shape), way

    def _faces(self, lens: Array, way: Array, T_plane: Array) -> tuple[Array, NDArray[np.int32]]:
        """Distance [m] to the nearest face along ways (m, r, 3), and which it is, -1 for none."""
        axes = T_plane[:, :3, :3].transpose(1, 0, 2).reshape(3, -1)  # (3, 3 P), of all faces
        middle = (T_plane[:, :3, 3, None] * T_plane[:, :3, :3]).sum(axis=1)  # (P, 3)
        at = (lens @ axes).reshape(len(lens), -1, 3) - middle
        down = (way.reshape(-1, 3) @ axes).reshape(*way.shape[:2], -1, 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(down[..., 2] < -GRAZING, -at[:, None, :, 2] / down[..., 2], np.inf)
            t[t <= 0.0] = np.inf
            aside = np.abs(at[:, None, :, :2] + t[..., None] * down[..., :2])
        half = np.array([p.half for p in self.planes])
        t[(aside > half).any(axis=3)] = np.inf
        which = t.argmin(axis=2)
        best = np.take_along_axis(t, which[..., None], axis=2)[..., 0]
        return best, np.where(np.isfinite(best), which, -1)


def _tangent(points: Array, lens: Array) -> tuple[Array, Array, Array]:
    """Normal (n, 3), height (n,) and bend (n,) of a surface met at points (n, 5, 3), its middle's
    first, from lenses (n, 3)."""
    normal = np.cross(points[:, 3] - points[:, 1], points[:, 4] - points[:, 2])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(length, 1e-12)
    normal *= np.sign(((lens - points[:, 0]) * normal).sum(axis=1, keepdims=True))
    heights = np.einsum("nij,nj->ni", points, normal)
    corners = heights[:, 1:].mean(axis=1)
    height = heights[:, 0] + (corners - heights[:, 0]) / (3 * MARGIN**2)
    bend = np.abs(heights - height[:, None]).max(axis=1)
    return normal, height, np.where(length[:, 0] > 1e-9, bend, np.inf)
