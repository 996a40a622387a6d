"""What is really there, in simulation. Sensors, the page and the metrics look at it; no one else.

Every body is rigid: its mesh is made ready for rays once, in its own frame, and then the rays
are moved. What nobody can move is one mesh in the base frame, made once.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from app.actions import AddObstacle, MoveObstacle, RemoveObstacle
from app.assets import asset_folder
from app.errors import WorldError, options
from app.messages import Array, BodyPose, BodyView, freeze
from app.raycast import Beams, Hits, RigidMesh, Solids
from app.world.motion import Motion, Still
from app.world.shapes import Shape, make_shape

Colour = tuple[int, int, int]
LONGEST_STEP = 10.0  # [s]
WORLD = -1  # label of a ray that ends on a body
PALETTE: tuple[Colour, ...] = (  # of added bodies; the muted set of P. Tol's colour schemes
    (204, 102, 119), (51, 136, 170), (221, 204, 119), (17, 119, 51),
    (136, 204, 238), (136, 34, 85), (68, 170, 153), (153, 153, 51),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Body:
    """A thing of the world: how it looks and how it moves. A movable one may be dragged.

    reflectance: of its surface, 0 to 1; None: drawn by those who see it.
    """

    name: str
    shape: Shape
    colour: Colour
    motion: Motion
    movable: bool = True
    reflectance: float | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Exchange:
    """Bodies that go, by name, and others that come: people, say."""

    gone: tuple[str, ...]
    come: tuple[Body, ...]


Edit = AddObstacle | MoveObstacle | RemoveObstacle | Exchange


class World:
    """Bodies and their poses at one time."""

    def __init__(self, bodies: Iterable[Body]) -> None:
        self._bodies: dict[str, Body] = {}
        self._views: dict[str, BodyView] = {}
        self.time = 0.0  # [s] since the beginning, without the pauses
        self._clock = self._missed = 0.0  # [s] as `step` was told; of it in pauses
        self._held: float | None = None  # [s] on that clock, where a pause holds it
        self._added = 0
        self._followers: list[Callable[[Edit], None]] = []
        for body in bodies:
            if body.name in self._bodies:
                raise WorldError(f"two bodies are called {body.name!r}; rename one")
            self._put(body)
        fixed = [b for b in self._bodies.values() if _fixed(b)]
        self._cell, self._cell_of = _merged(fixed), [(b.name, len(b.shape.faces)) for b in fixed]
        self._arrange()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_followers": []}  # a copy has its own

    # --- changing it ----------------------------------------------------------------------

    def follow(self, told: Callable[[Edit], None]) -> None:
        """Have `told` called with every edit from now on; made of a copy, it keeps step."""
        self._followers.append(told)

    def edit(self, action: Edit) -> None:
        """Do what a person asked for, or what was done to the world that this one follows."""
        match action:
            case AddObstacle(name=name, shape=shape, position=position):
                self.add(name, shape, position)
            case MoveObstacle(name=name, T_base_body=T):
                self.move(name, T)
            case RemoveObstacle(name=name):
                self.remove(name)
            case Exchange():
                self.exchange(action)

    def add(self, name: str, shape: Mapping[str, Any], position: Sequence[float]) -> str:
        """Put a movable body at `position` (3,) [m], base frame; returns its unique name.

        An empty or taken name gets a number. A mesh file is looked for among the assets.
        """
        where = f"new body {name!r}" if name else "new body"
        made = make_shape(shape, asset_folder("static_assets"), where)
        place = np.array(position, dtype=np.float64)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise WorldError(f"{where}: position = {position!r}; give 3 finite numbers")
        T = np.eye(4)
        T[:3, 3] = place
        unique = name if name and name not in self._bodies else self._numbered(name or made.kind)
        self._put(Body(unique, made, PALETTE[self._added % len(PALETTE)], Still(freeze(T))))
        self._added += 1
        x, y, z = place.tolist()
        self._arrange(AddObstacle(unique, dict(shape), (x, y, z)))
        return unique

    def move(self, name: str, T_base_body: Array) -> None:
        """Put a body elsewhere (4, 4); a scripted one stops following its script."""
        body = self._movable(name, "moved")
        T = np.array(T_base_body, dtype=np.float64)
        if T.shape != (4, 4) or not np.isfinite(T).all():
            raise WorldError(f"body {name!r} cannot go there; give a finite 4x4 pose")
        self._bodies[name] = replace(body, motion=Still(freeze(T)))
        self._arrange(MoveObstacle(name, T))

    def remove(self, name: str) -> None:
        """Take a body out."""
        self._movable(name, "removed")
        del self._bodies[name], self._views[name]
        self._arrange(RemoveObstacle(name))

    def exchange(self, bodies: Exchange) -> None:
        """Take some bodies out, put others in."""
        for name in bodies.gone:
            del self._bodies[name], self._views[name]
        for body in bodies.come:
            if body.name in self._bodies:
                raise WorldError(f"two bodies are called {body.name!r}; take one out first")
            self._put(body)
        self._arrange(bodies)

    @property
    def people(self) -> tuple[str, ...]:
        """Names of the bodies that follow a script and that nobody can move: parts of people."""
        return tuple(b.name for b in self._all if not b.movable and not _stands(b))

    def step(self, t: float) -> None:
        """Let every body be where its script has it at `t` [s], less what was paused; worked out
        when first asked for."""
        self._clock = t
        self.time = (t if self._held is None else self._held) - self._missed
        self._behind = True

    def pause(self, paused: bool) -> None:
        """Let scripts stand still from now on, or go on from where they stand."""
        if paused and self._held is None:
            self._held = self._clock
        elif not paused and self._held is not None:
            self._missed += self._clock - self._held
            self._held = None

    def skip(self, seconds: float) -> None:
        """Let scripts that stand still go on for so long [s]; WorldError where they do not."""
        if self._held is None:
            raise WorldError("the world is not paused; pause it first")
        if not 0.0 < seconds <= LONGEST_STEP:
            raise WorldError(f"a step of {seconds:g} s; give up to {LONGEST_STEP:g} s")
        self._held += seconds
        self.step(self._clock)

    # --- looking at it --------------------------------------------------------------------

    def poses(self) -> tuple[BodyPose, ...]:
        """Every body with its pose; a view stays the same object while the looks do."""
        return tuple(map(BodyPose, self._views.values(), freeze(self._poses()[:-1].copy())))

    def shapes(self) -> dict[str, Shape]:
        """The shape of every body by name, in the order of `poses`."""
        return {name: body.shape for name, body in self._bodies.items()}

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All of them, in the order of `poses`; the same tuple while they are the same."""
        return self._all

    def end_rays(self, beams: Beams, hits: Hits) -> None:
        """End rays where they first hit a body; those get the label WORLD, and its place among
        `bodies`."""
        blind = np.zeros((len(beams.origin), len(self._hit)), dtype=np.bool_)
        self._solids.end_rays(self._poses()[self._hit], beams, blind, hits)

    # --- inside ---------------------------------------------------------------------------

    def _poses(self) -> Array:
        """(n + 1, 4, 4) of all bodies in their order, and of the cell in the base frame."""
        if self._behind:
            for i, motion in self._moving:
                self._T[i] = motion.pose(self.time)
            self._behind = False
        return self._T

    def _put(self, body: Body) -> None:
        self._bodies[body.name] = body
        shape = body.shape
        self._views[body.name] = BodyView(
            body.name, shape.vertices, shape.faces, body.colour, body.movable
        )

    def _arrange(self, edit: Edit | None = None) -> None:
        """Line up what poses and casts need, after the bodies have changed, and tell of it."""
        bodies = list(self._bodies.values())
        self._all = tuple(bodies)
        self._T = np.array([*(b.motion.pose(self.time) for b in bodies), np.eye(4)])
        self._moving = [(i, b.motion) for i, b in enumerate(bodies) if not _stands(b)]
        self._behind = False
        hit = [i for i, b in enumerate(bodies) if not _fixed(b)]
        meshes = [bodies[i].shape.hit for i in hit]
        owner = [np.array([i], dtype=np.int16) for i in hit]
        if self._cell is not None:
            hit.append(len(bodies))
            meshes.append(self._cell)
            place = {name: i for i, name in enumerate(self._bodies)}
            parts = [np.full(faces, place[name], np.int16) for name, faces in self._cell_of]
            owner.append(np.concatenate(parts))
        self._hit = np.array(hit, dtype=np.int64)
        self._solids = Solids(meshes, np.full(len(hit), WORLD, dtype=np.int16), owner)
        if edit is not None:
            for told in self._followers:
                told(edit)

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


def _stands(body: Body) -> bool:
    return isinstance(body.motion, Still)


def _fixed(body: Body) -> bool:
    """Will it stand where it is for ever?"""
    return _stands(body) and not body.movable


def _merged(bodies: Sequence[Body]) -> RigidMesh | None:
    """All that stands still for ever as one mesh in the base frame, so that one cast meets it."""
    vertices, faces, boxes, count = [], [], [], 0
    for body in bodies:
        T, v = body.motion.pose(0.0), body.shape.vertices
        vertices.append(v @ T[:3, :3].T + T[:3, 3])
        boxes.append([vertices[-1].min(axis=0), vertices[-1].max(axis=0)])
        faces.append(body.shape.faces + count)
        count += len(v)
    if not bodies:
        return None
    return RigidMesh(np.concatenate(vertices), np.concatenate(faces), np.array(boxes))
