"""The true distance between the robot's links and the simulated world. For judging only.

Links are meshes; the world's boxes, spheres, capsules and cylinders are exact solids, its
mesh bodies are surfaces. An exact answer costs up to a millisecond, so every pair is first
bounded from below by the distance of the convex hulls, which costs microseconds and is mostly the
answer itself, and only pairs that may still be the nearest are measured.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import coal
import numpy as np
from numpy.typing import NDArray

from app.errors import WorldError, options
from app.messages import Array, BodyPose
from app.world.shapes import Shape
from app.world.world import World

FLAT = 1e-6  # [m]
ROUNDING = 1e-5  # [m] distances of hulls are off by less


class Hull(NamedTuple):
    """A geometry to measure, and its convex hull to bound with."""

    exact: Any
    hull: Any


class TruePair(NamedTuple):
    """Where a link and a body are closest, base frame.

    link: row of the links.   distance: [m], zero or less on contact.
    on_link, on_body: (3,) [m] the two points.   normal: (3,) unit, from the body to the link.
    """

    link: int
    body: str
    distance: float
    on_link: Array
    on_body: Array
    normal: Array


class TrueDistance:
    """Distances from every link to everything in a world.

    bodies: (vertices (V, 3) [m], faces (F, 3)) of each link, link frame.
    """

    def __init__(self, bodies: Sequence[tuple[Array, NDArray[np.int64]]]) -> None:
        self._links = [surface(vertices, faces) for vertices, faces in bodies]
        self._solids: dict[Shape, Hull] = {}  # each shape is prepared when first met
        self._request, self._rough = coal.DistanceRequest(), coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._rough.enable_signed_distance = False

    def measure(self, T_base_link: Array, world: World, leave_out: Collection[str] = ()) -> Array:
        """Distances (L,) [m] of links posed at T_base_link (L, 4, 4) to their nearest body.

        Zero or less on contact, but not a depth to rely on; +inf without any body. A body
        that lies inside a link without touching its surface counts as outside. Bodies named
        in `leave_out` are ignored, such as the table that the base stands on; WorldError if
        there is none of that name.
        """
        return np.array([d for d, _ in self.nearest(T_base_link, world, leave_out)])

    def nearest(
        self,
        T_base_link: Array,
        world: World,
        leave_out: Collection[str] = (),
        poses: Sequence[BodyPose] | None = None,
    ) -> list[tuple[float, str]]:
        """As `measure`, with the name of each link's nearest body ("" without any body).

        poses: of the world's bodies at another time; None: as they are now.
        """
        shapes = world.shapes()
        for name in leave_out:
            if name not in shapes:
                raise WorldError(f"no body {name!r} to leave out; {options(name, shapes)}")
        others = [
            (p.view.name, self._solid(shapes[p.view.name]), p.T_base_body)
            for p in (world.poses() if poses is None else poses)
            if p.view.name not in leave_out
        ]
        return [
            self._nearest(link, T, others) for link, T in zip(self._links, T_base_link, strict=True)
        ]

    def _nearest(
        self, link: Hull, T_base_link: Array, others: list[tuple[str, Hull, Array]]
    ) -> tuple[float, str]:
        bounds = [
            (self._bound(link, T_base_link, solid, T), i) for i, (_, solid, T) in enumerate(others)
        ]
        best, nearest = np.inf, ""
        for bound, i in sorted(bounds):
            if bound >= best:
                break
            name, solid, T = others[i]
            d = self._distance(link.exact, _at(T_base_link), solid.exact, _at(T))
            if d < best:
                best, nearest = d, name
        return best, nearest

    def near_pairs(
        self, T_base_link: Array, shapes: Mapping[str, Shape], bodies: Sequence[BodyPose],
        within: float,
    ) -> list[TruePair]:  # fmt: skip
        """The pair of each link, posed at T_base_link (L, 4, 4), and each of `bodies` that are
        less than `within` [m] apart."""
        found = []
        for link, T in enumerate(T_base_link):
            hull = self._links[link]
            for body in bodies:
                solid, T_body = self._solid(shapes[body.view.name]), body.T_base_body
                if self._bound(hull, T, solid, T_body) >= within:
                    continue
                pair = self.closest(link, T, body.view.name, shapes[body.view.name], T_body)
                if pair.distance < within:
                    found.append(pair)
        return found

    def closest(
        self, link: int, T_base_link: Array, body: str, shape: Shape, T_base_body: Array
    ) -> TruePair:
        """Where one link, posed at T_base_link (4, 4), and one body are closest."""
        result, at_link, at_body = coal.DistanceResult(), _at(T_base_link), _at(T_base_body)
        exact, solid = self._links[link].exact, self._solid(shape).exact
        d = float(coal.distance(exact, at_link, solid, at_body, self._request, result))
        on_link, on_body = result.getNearestPoint1(), result.getNearestPoint2()
        normal = -np.array(result.normal)
        return TruePair(link, body, d, np.array(on_link), np.array(on_body), normal)

    def pair(
        self, link: int, T_base_link: Array, shape: Shape, T_base_body: Array, needed: float
    ) -> float:
        """Distance [m] of one link, posed at T_base_link (4, 4), to one body.

        Not measured where that cannot be below `needed` [m]: then a lower bound, not below it.
        """
        return self.pair_with_point(link, T_base_link, shape, T_base_body, needed)[0]

    def pair_with_point(
        self, link: int, T_base_link: Array, shape: Shape, T_base_body: Array, needed: float
    ) -> tuple[float, Array | None]:
        """As `pair`, with the body's nearest point (3,) [m], base frame; None: not measured."""
        hull, solid = self._links[link], self._solid(shape)
        bound = self._bound(hull, T_base_link, solid, T_base_body)
        if bound >= needed:
            return bound, None
        result = coal.DistanceResult()
        at_link, at_body = _at(T_base_link), _at(T_base_body)
        d = float(coal.distance(hull.exact, at_link, solid.exact, at_body, self._request, result))
        return d, np.array(result.getNearestPoint2())

    def _bound(self, link: Hull, T_base_link: Array, solid: Hull, T_base_body: Array) -> float:
        at_link, at_body = _at(T_base_link), _at(T_base_body)
        result = coal.DistanceResult()
        bound = coal.distance(link.hull, at_link, solid.hull, at_body, self._rough, result)
        # hulls that overlap say nothing of how deep the exact shapes do
        return bound - ROUNDING if bound > ROUNDING else -np.inf

    def _distance(self, a: Any, at_a: Any, b: Any, at_b: Any) -> float:
        return float(coal.distance(a, at_a, b, at_b, self._request, coal.DistanceResult()))

    def _solid(self, shape: Shape) -> Hull:
        if shape not in self._solids:
            self._solids[shape] = _solid(shape)
        return self._solids[shape]


def _solid(shape: Shape) -> Hull:
    """A world's shape; a primitive is its own hull."""
    makers = {
        "box": coal.Box,
        "panel": coal.Box,
        "sphere": coal.Sphere,
        "cylinder": coal.Cylinder,
        "capsule": coal.Capsule,
    }
    if shape.kind not in makers:
        return surface(shape.vertices, shape.faces)
    solid = makers[shape.kind](*shape.dims)
    return Hull(solid, solid)


def distance_between(a: Hull, T_base_a: Array, b: Hull, T_base_b: Array) -> float:
    """Distance [m] of two posed geometries; zero or less where they touch."""
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    at_a, at_b = _at(T_base_a), _at(T_base_b)
    return float(coal.distance(a.exact, at_a, b.exact, at_b, request, coal.DistanceResult()))


def surface(vertices: Array, faces: NDArray[np.int64]) -> Hull:
    """A mesh ready to be measured."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(vertices))
    model.addVertices(np.asarray(vertices, dtype=np.float64))
    model.addTriangles(np.asarray(faces))
    model.endModel()
    return Hull(model, _convex(vertices[np.unique(faces)]))


def _convex(points: Array) -> Any:
    """The convex hull of points (n, 3) [m]; what is flat is made `FLAT` thick each way."""
    _, lengths, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if lengths[-1] < FLAT * np.sqrt(len(points)):
        points = np.concatenate((points + FLAT * axes[-1], points - FLAT * axes[-1]))
    model = coal.BVHModelOBBRSS()
    model.beginModel(0, len(points))
    model.addVertices(points)
    model.buildConvexHull(False, "Qt")
    return model.convex


def _at(T: Array) -> Any:
    """A pose (4, 4) as coal wants it."""
    return coal.Transform3s(T[:3, :3], T[:3, 3])
