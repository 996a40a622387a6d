"""What is really there, in simulation. Sensors, the page and the metrics look at it; no one else.

Every body is rigid: its mesh is made ready for rays once, in its own frame, and then the rays
are moved. A body whose bounding sphere no ray of a sensor can reach is left out of a cast.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.assets import asset_folder
from app.errors import WorldError, options
from app.messages import Array, BodyPose, BodyView, CropBox, freeze
from app.raycast import MISS, to_body
from app.world.motion import Motion, Still
from app.world.reach import reached
from app.world.shapes import Shape, make_shape
from app.world.tables import transform, vector

Colour = tuple[int, int, int]
Cone = tuple[Array, Array, float, float]  # apex, unit axis, half angle, far: see World.cast
PALETTE: tuple[Colour, ...] = (  # of added bodies; the muted set of P. Tol's colour schemes
    (204, 102, 119), (51, 136, 170), (221, 204, 119), (17, 119, 51),
    (136, 204, 238), (136, 34, 85), (68, 170, 153), (153, 153, 51),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Body:
    """A thing of the world: how it looks and how it moves. A movable one may be dragged."""

    name: str
    shape: Shape
    colour: Colour
    motion: Motion
    movable: bool = True


class World:
    """Bodies and their poses at one time, and the crop boxes of the static ones."""

    def __init__(self, bodies: Iterable[Body], crops: Iterable[CropBox] = ()) -> None:
        self.crops: tuple[CropBox, ...] = tuple(crops)
        self._bodies: dict[str, Body] = {}
        self._views: dict[str, BodyView] = {}
        self._t = 0.0
        self._added = 0
        for body in bodies:
            if body.name in self._bodies:
                raise WorldError(f"two bodies are called {body.name!r}; rename one")
            self._put(body)
        self._arrange()

    # --- changing it ----------------------------------------------------------------------

    def add(self, name: str, shape: Mapping[str, Any], position: Sequence[float]) -> str:
        """Put a movable body at `position` (3,) [m], base frame; returns its unique name.

        An empty or taken name gets a number. A mesh file is looked for among the assets.
        """
        where = f"new body {name!r}" if name else "new body"
        made = make_shape(shape, asset_folder("static_assets"), where)
        T = transform(vector({"position": list(position)}, "position", where), np.zeros(3))
        unique = name if name and name not in self._bodies else self._numbered(name or made.kind)
        self._put(Body(unique, made, PALETTE[self._added % len(PALETTE)], Still(freeze(T))))
        self._added += 1
        self._arrange()
        return unique

    def move(self, name: str, T_base_body: Array) -> None:
        """Put a body elsewhere (4, 4); a scripted one stops following its script."""
        body = self._movable(name, "moved")
        T = np.array(T_base_body, dtype=np.float64)
        if T.shape != (4, 4) or not np.isfinite(T).all():
            raise WorldError(f"body {name!r} cannot go there; give a finite 4x4 pose")
        self._bodies[name] = replace(body, motion=Still(freeze(T)))
        self._arrange()

    def remove(self, name: str) -> None:
        """Take a body out."""
        self._movable(name, "removed")
        del self._bodies[name], self._views[name]
        self._arrange()

    def step(self, t: float) -> None:
        """Let every body be where its script has it at `t` [s]."""
        self._t = t
        poses = np.array([b.motion.pose(t) for b in self._bodies.values()])
        self._T = freeze(poses.reshape(-1, 4, 4))
        self._centres = np.einsum("nij,nj->ni", self._T[:, :3], self._centres_body)

    # --- looking at it --------------------------------------------------------------------

    def poses(self) -> tuple[BodyPose, ...]:
        """Every body with its pose; a view stays the same object while the looks do."""
        return tuple(map(BodyPose, self._views.values(), self._T))

    def shapes(self) -> dict[str, Shape]:
        """The shape of every body by name, in the order of `poses`."""
        return {name: body.shape for name, body in self._bodies.items()}

    def cast(self, origins_base: Array, directions_base: Array, cone: Cone) -> NDArray[np.float32]:
        """First hits (n,) [m] along unit directions (n, 3) from origins (n, 3), base frame.

        cone: apex (3,) [m] and unit axis (3,) in the base frame, half angle [rad, below pi/2]
            and `far` [m]. Every ray begins and runs within the half angle of the axis, as
            seen from the apex, and is followed for `far` from its own origin.
        `MISS` (+inf) where nothing is hit.
        """
        nearest = np.full(len(origins_base), MISS, dtype=np.float32)
        within = reached(origins_base, *cone, self._centres, self._radii)
        for i in within.nonzero()[0].tolist():
            o, d = to_body(self._T[i], origins_base, directions_base)
            np.minimum(nearest, self._hits[i].cast(o, d), out=nearest)
        nearest[nearest > cone[3]] = MISS
        return nearest

    # --- inside ---------------------------------------------------------------------------

    def _put(self, body: Body) -> None:
        self._bodies[body.name] = body
        shape = body.shape
        self._views[body.name] = BodyView(
            body.name, shape.vertices, shape.faces, body.colour, body.movable
        )

    def _arrange(self) -> None:
        """Line up what a cast needs, after the bodies have changed."""
        self._hits = [b.shape.hit for b in self._bodies.values()]
        self._radii = np.array([hit.radius for hit in self._hits]) * (1 + 1e-6)  # float32 meshes
        self._centres_body = np.array([[*hit.centre, 1.0] for hit in self._hits]).reshape(-1, 4)
        self.step(self._t)

    def _numbered(self, stem: str) -> str:
        return next(n for k in count(1) if (n := f"{stem} {k}") not in self._bodies)

    def _movable(self, name: str, done: str) -> Body:
        names = [b.name for b in self._bodies.values() if b.movable]
        if name not in self._bodies:
            raise WorldError(f"there is no body {name!r} to be {done}; {options(name, names)}")
        if not self._bodies[name].movable:
            why = "is scripted or part of the static cell"
            raise WorldError(f"body {name!r} {why} and cannot be {done}; {options(name, names)}")
        return self._bodies[name]
