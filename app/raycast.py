"""First hits of rays on a rigid mesh, through Embree.

A rigid body's tree is built once, in the body's own frame; it is the rays that are moved.
Embree computes in float32, about 1e-6 m at arm's length. Never transform a mesh that backs
a scene: the scene would go on answering for the old shape without a word (trimesh#2324).

A cast costs a ray about five times the test whether it enters the mesh's box, and gives the
interpreter's lock away. So rays of many sensors go together, and only those whose answer
the mesh may change are cast: a bundle of them is first tried as a cone.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from embreex import rtcore, rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

MISS = np.float32(np.inf)
SLACK = 1e-5  # [m], and share of a body's size: how far rounding to float32 may move a hit
_DEVICE = rtcore.EmbreeDevice()  # one for all: with a thousand of its own the process crashed


class Beams(NamedTuple):
    """Rays in m bundles, base frame; those of one bundle begin at one point.

    origin: (m, 3) [m].   axis: (m, 3) unit.   half_angle: (m,) [rad] of the cone round the axis
            that holds all rays of a bundle.
    first:  (m + 1,) int64: rays first[b] to first[b + 1] are those of bundle b.
    direction: (n, 3) unit.
    """

    origin: Array
    axis: Array
    half_angle: Array
    first: NDArray[np.int64]
    direction: Array


class Hits(NamedTuple):
    """Where n rays end: length (n,) [m], and label (n,) of what is there.

    body:   (n,) which one of its kind it is.   cosine: (n,) of the angle of incidence.
    """

    length: NDArray[np.float32]
    label: NDArray[np.int16]
    body: NDArray[np.int16]
    cosine: NDArray[np.float32]


def no_hits(far: NDArray[np.float32], label: int) -> Hits:
    """Of rays that end in the air, `far` (n,) [m] away; what is there has the `label`."""
    n = len(far)
    return Hits(
        far, np.full(n, label, dtype=np.int16), np.zeros(n, dtype=np.int16),
        np.ones(n, dtype=np.float32),
    )  # fmt: skip


class RigidMesh:
    """A mesh ready to be hit: vertices (V, 3) [m] and faces (F, 3), both in the body frame.

    The tree is built by the first cast. What is pickled is the mesh alone.
    parts: (P, 2, 3) [m] corners of boxes that hold it together; None: one holds it.
    """

    def __init__(
        self, vertices: Array, faces: NDArray[np.int64], parts: Array | None = None
    ) -> None:
        if len(faces) == 0:
            raise ValueError("a mesh without faces cannot be hit; leave the body out instead")
        self.vertices, self.faces = vertices, faces
        self._scene: rtcore_scene.EmbreeScene | None = None
        # the smallest sphere is not needed; one around the box's centre culls well enough
        used = vertices[np.unique(faces)]
        low, high = used.min(axis=0), used.max(axis=0)
        self.centre: Array = (low + high) / 2.0
        self.radius = float(np.linalg.norm(used - self.centre, axis=1).max())
        slack = SLACK * (1.0 + np.abs(used).max())
        self.box: Array = np.array([low - slack, high + slack])
        self._parts = parts
        wider = np.array([[-slack], [slack]])
        self.parts: Array = self.box[None] if parts is None else parts + wider

    def __reduce__(self) -> tuple[Any, ...]:
        return RigidMesh, (self.vertices, self.faces, self._parts)

    def cast(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Distances (n,) [m] along unit `directions` (n, 3) from `origins` (n, 3), body frame.

        `MISS` (+inf) where nothing is hit. Rays that start inside hit the inner side.
        """
        if len(origins) == 0:
            return np.empty(0, dtype=np.float32)
        t: NDArray[np.float32] = self._tree().run(origins, directions, query="DISTANCE")
        t[t >= 1e30] = MISS
        return t

    def meet(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]:
        """As `cast`, for one ray at least, with the face that is met, -1 for none, and a normal
        (n, 3) of any length."""
        met = self._tree().run(origins, directions, output=True)
        t = met["tfar"]
        t[t >= 1e30] = MISS
        return t, met["primID"], met["Ng"]

    def _tree(self) -> rtcore_scene.EmbreeScene:
        if self._scene is None:
            self._scene = rtcore_scene.EmbreeScene(_DEVICE)
            self._mesh = TriangleMesh(
                self._scene,
                np.ascontiguousarray(self.vertices, dtype=np.float32),
                np.ascontiguousarray(self.faces, dtype=np.int32),
            )
        return self._scene


class Solids:
    """Meshes that rays end on, with the label (B,) that each of them leaves.

    owner: of each mesh, the body that all of its faces (1,) or each of them (F,) belongs to;
           None: a mesh is a body.
    """

    def __init__(
        self, meshes: Sequence[RigidMesh], label: NDArray[np.int16],
        owner: Sequence[NDArray[np.int16]] | None = None,
    ) -> None:  # fmt: skip
        self._meshes = tuple(meshes)
        self._owner = owner or [np.array([i], dtype=np.int16) for i in range(len(meshes))]
        part = np.concatenate([np.empty((0, 2, 3)), *(m.parts for m in meshes)])
        self._shape = _Shapes(
            part,
            part.mean(axis=1),
            np.linalg.norm(part[:, 1] - part[:, 0], axis=1) / 2.0,
            np.cumsum([0, *(len(m.parts) for m in meshes)]),
            np.array([m.centre for m in meshes]).reshape(-1, 3),
            np.array([m.radius for m in meshes]),
            label,
        )

    def end_rays(
        self, T_base_body: Array, beams: Beams, blind: NDArray[np.bool_], hits: Hits
    ) -> None:
        """End rays where they first hit a mesh posed at T_base_body (B, 4, 4).

        blind: (m, B) bodies that the rays of a bundle do not see.
        """
        ray, at, way, last = _rays_entering(self._shape, T_base_body, beams, blind, hits.length)
        first = 0
        for i, end in enumerate(last.tolist()):
            if end > first:
                part = slice(first, end)
                t, face, normal = self._meshes[i].meet(at[part], way[part])
                label, owner = int(self._shape.label[i]), self._owner[i]
                _end_at(t, face, normal, way[part], ray[part], label, owner, hits)
            first = end


class _Shapes(NamedTuple):
    """What is known of B meshes in their frames: sphere and label; and of their parts, box
    (P, 2, 3) and sphere, those of mesh i from first[i] to first[i + 1]."""

    part: Array
    part_centre: Array
    part_radius: Array
    first: NDArray[np.int64]
    centre: Array
    radius: Array
    label: NDArray[np.int16]


@compiled
def _rays_entering(
    shapes: _Shapes,
    T_base_body: Array,
    beams: Beams,
    blind: NDArray[np.bool_],
    length: NDArray[np.float32],
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Rays that enter a part of a body before they end, body by body, and those in its frame.

    The fourth, (B,), is where the rays of each body end in the other three.
    """
    bodies, room = len(shapes.radius), len(beams.direction)
    cos, sin = np.cos(beams.half_angle), np.sin(beams.half_angle)
    ray = np.empty(room, dtype=np.int64)
    at, way = np.empty((room, 3), dtype=np.float32), np.empty((room, 3), dtype=np.float32)
    last = np.empty(bodies, dtype=np.int64)
    origin, axis, d, per_metre = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    ahead = np.empty(len(shapes.part), dtype=np.int64)
    found = 0
    for i in range(bodies):
        T = T_base_body[i]
        for b in range(len(beams.origin)):
            if blind[b, i]:
                continue
            for j in range(3):
                d[j] = beams.origin[b, j] - T[j, 3]
            _into(T, d, origin)
            _into(T, beams.axis[b], axis)
            if not _in_cone(shapes.centre[i], origin, shapes.radius[i], axis, cos[b], sin[b]):
                continue
            begin, end = beams.first[b], beams.first[b + 1]
            if found + end - begin > len(ray):
                ray, at, way = _longer(ray, at, way)
            parts = _parts_ahead(shapes, i, origin, axis, cos[b], sin[b], ahead)
            for n in range(begin, end):
                _into(T, beams.direction[n], d)
                for j in range(3):
                    per_metre[j] = 1.0 / (d[j] if abs(d[j]) > 1e-30 else 1e-30)
                if _enters_one(shapes.part, ahead[:parts], origin, per_metre, length[n]):
                    ray[found] = n
                    for j in range(3):
                        at[found, j], way[found, j] = origin[j], d[j]
                    found += 1
        last[i] = found
    return ray[:found], at[:found], way[:found], last


@compiled
def _into(T_base_body: Array, v: Array, out: Array) -> None:
    """A vector (3,) of the base frame in the axes of a body."""
    T = T_base_body
    for j in range(3):
        out[j] = T[0, j] * v[0] + T[1, j] * v[1] + T[2, j] * v[2]


@compiled
def _longer(
    ray: NDArray[np.int64], at: NDArray[np.float32], way: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    return (
        np.concatenate((ray, np.empty_like(ray))),
        np.concatenate((at, np.empty_like(at))),
        np.concatenate((way, np.empty_like(way))),
    )


@compiled
def _in_cone(
    centre: Array, origin: Array, radius: float, axis: Array, cos: float, sin: float
) -> bool:
    """May a sphere reach into the cone round `axis` from the origin? cos, sin: of its half angle.

    The distance to the plane that touches the cone beside the sphere is a lower bound of the
    distance to the cone.
    """
    along, square = 0.0, 0.0
    for i in range(3):
        to = centre[i] - origin[i]
        along += to * axis[i]
        square += to * to
    aside = np.sqrt(max(square - along * along, 0.0))
    beside = aside * cos - along * sin
    return beside <= radius * (1.0 + SLACK) + SLACK and along >= -radius * (1.0 + SLACK) - SLACK


@compiled
def _parts_ahead(
    shapes: _Shapes, body: int, origin: Array, axis: Array, cos: float, sin: float,
    ahead: NDArray[np.int64],
) -> int:  # fmt: skip
    """Write the parts of a body that may reach into a cone which reaches it; how many they are."""
    first, last, found = shapes.first[body], shapes.first[body + 1], 0
    for p in range(first, last):
        centre, radius = shapes.part_centre[p], shapes.part_radius[p]
        if last - first == 1 or _in_cone(centre, origin, radius, axis, cos, sin):
            ahead[found] = p
            found += 1
    return found


@compiled
def _enters_one(
    part: Array, ahead: NDArray[np.int64], origin: Array, per_metre: Array, length: float
) -> bool:
    """Does a ray enter one of the parts (P, 2, 3) that are ahead?"""
    for p in ahead:  # noqa: SIM110  numba knows no any() of a generator
        if _enters(part[p], origin, per_metre, length):
            return True
    return False


@compiled
def _enters(box: Array, origin: Array, per_metre: Array, length: float) -> bool:
    """Is a ray of `length` in the box (2, 3) before it ends? By the slabs between its faces.

    per_metre: (3,) one over its direction.
    """
    near, far = 0.0, length + SLACK
    for i in range(3):
        a, b = (box[0, i] - origin[i]) * per_metre[i], (box[1, i] - origin[i]) * per_metre[i]
        near, far = max(near, min(a, b)), min(far, max(a, b))
    return near <= far


@compiled
def _end_at(
    t: NDArray[np.float32],
    face: NDArray[np.int32],
    normal: NDArray[np.float32],
    way: NDArray[np.float32],
    ray: NDArray[np.int64],
    label: int,
    owner: NDArray[np.int16],
    hits: Hits,
) -> None:
    """End the rays whose cast is the shorter one at a mesh of this label and these owners."""
    for j in range(len(ray)):
        n = ray[j]
        if not t[j] < hits.length[n]:
            continue
        hits.length[n], hits.label[n] = t[j], label
        hits.body[n] = owner[face[j]] if len(owner) > 1 else owner[0]
        along, square = np.float32(0.0), np.float32(0.0)
        for i in range(3):
            along += normal[j, i] * way[j, i]
            square += normal[j, i] * normal[j, i]
        hits.cosine[n] = abs(along) / np.sqrt(square) if square > 0.0 else 0.0
