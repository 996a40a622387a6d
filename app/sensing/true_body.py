"""The surfaces of an arm as they truly are: not quite their meshes, and with hoses on them.

A link's surface lies off its mesh by a smooth random field of some millimetres. Along each long
link that moves runs a hose that no model knows of, where it keeps out of the view of the link's
own sensors, as whoever has tied it there made sure. Covers are printed from the very mesh.
"""

import numpy as np

from app.messages import Array, freeze
from app.raycast import RigidMesh
from app.robot.meshes import BodyMesh
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.truth_parts import Part, stream
from app.world.shapes import capsule

OFF = 0.0015  # [m] 1 sigma at strength 1
WAVE = 0.1  # [m] over which the field changes
FEATURES = 24  # waves that make the field
LONG = 0.25  # [m] extent of a link that has a hose
HOSE = (0.003, 0.007)  # [m] radius
RUN = (0.15, 0.85)  # share of the link along which it runs
TRIES = 24  # places for a hose


def true_bodies(robot: Robot, skin: Skin, strength: float, seed: int) -> list[BodyMesh]:
    """The surface of each body link, link frame; skin: where its sensors are."""
    bodies = []
    for i, (link, body) in enumerate(zip(robot.links, robot.bodies, strict=True)):
        if link not in robot.covers:
            rng = stream(seed, Part.BODY, i)
            body = _uneven(body, strength * OFF, rng)
            if robot.supports[i].any() and np.ptp(body.vertices, axis=0).max() > LONG:
                body = _with_hose(body, _views(robot, skin, i), rng)
        bodies.append(body)
    return bodies


def _uneven(body: BodyMesh, sigma: float, rng: np.random.Generator) -> BodyMesh:
    """Moved along its normals by a random field of waves, `sigma` [m]."""
    # a corner of several faces may be written once a face: it moves as one, or the mesh tears
    place, one = np.unique(body.vertices.round(6), axis=0, return_inverse=True)
    one = one.ravel()
    a, b, c = (body.vertices[body.faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)  # twice the area, along the normal
    normal = np.zeros_like(place)
    for i in range(3):
        np.add.at(normal, one[body.faces[:, i]], across)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    wave = rng.standard_normal((FEATURES, 3)) * (2.0 * np.pi / WAVE / np.sqrt(3.0))
    phase = rng.uniform(0.0, 2.0 * np.pi, FEATURES)
    field = np.sqrt(2.0 / FEATURES) * np.cos(place @ wave.T + phase).sum(axis=1)
    moved = body.vertices + (sigma * field[:, None] * normal)[one]
    return BodyMesh(freeze(moved), body.faces)


def _views(robot: Robot, skin: Skin, link: int) -> tuple[Array, Array]:
    """Lenses and directions (n, 3) of the zones of all sensors that move with a link, its frame."""
    lens, way = [np.empty((0, 3))], [np.empty((0, 3))]
    for k in np.flatnonzero(robot.welded[link][skin.link]):
        T = robot.T_link_link(link, int(skin.link[k]))
        rays = skin.rays[skin.zones(int(k))].reshape(-1, 3) @ T[:3, :3].T
        lens.append(np.tile(T[:3, :3] @ skin.origin[k] + T[:3, 3], (len(rays), 1)))
        way.append(rays)
    return np.concatenate(lens), np.concatenate(way)


def _with_hose(
    body: BodyMesh, views: tuple[Array, Array], rng: np.random.Generator
) -> BodyMesh:  # fmt: skip
    """With a hose along its longest extent; as it is where every place for one is in a view."""
    mesh, radius = RigidMesh(body.vertices, body.faces), rng.uniform(*HOSE)
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    along = int(np.argmax(high - low))
    for turn in rng.uniform(0.0, 2.0 * np.pi, TRIES):
        out = np.insert([np.cos(turn), np.sin(turn)], along, 0.0)
        ends = np.tile((low + high) / 2.0, (2, 1))
        ends[:, along] = low[along] + np.array(RUN) * (high - low)[along]
        ends += out  # a metre outside, from where the surface is looked for
        t = mesh.cast(ends.astype(np.float32), np.tile(-out, (2, 1)).astype(np.float32))
        if not np.isfinite(t).all():
            continue
        hose = _hose(ends - (t[:, None] - radius) * out, radius)
        seen = RigidMesh(hose.vertices, hose.faces).cast(*(v.astype(np.float32) for v in views))
        if not np.isfinite(seen).any():
            return BodyMesh(
                freeze(np.concatenate([body.vertices, hose.vertices])),
                freeze(np.concatenate([body.faces, hose.faces + len(body.vertices)])),
            )
    return body


def _hose(ends: Array, radius: float) -> BodyMesh:
    """A capsule between two points (2, 3)."""
    way = ends[1] - ends[0]
    shape = capsule(radius, float(np.linalg.norm(way)))
    z = way / np.linalg.norm(way)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    return BodyMesh(shape.vertices @ R.T + ends.mean(axis=0), shape.faces)
