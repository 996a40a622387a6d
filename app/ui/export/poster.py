"""A still picture of a clip for an index, by casting rays: a page draws, but only in a browser."""

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.colours import activation_colour
from app.messages import Array, Snapshot, Verdict
from app.raycast import RigidMesh
from app.ui.colours import POINT, REMEMBERED, RGB
from app.ui.export.eye import FOV, Eye
from app.ui.export.film import Arm

SIZE = (480, 300)  # [px]
FINER = 2  # rays of a pixel, across and down
SUN = np.array([0.35, -0.55, 0.76])
SKY = np.array([[206.0, 216.0, 228.0], [250.0, 251.0, 252.0]])  # top, bottom, as on the page
GROUND = np.array([236.0, 238.0, 241.0])
SHADES = 4  # steps of 0..255 in a channel: less is not seen, and the file is a third of the size
Picture = NDArray[np.uint8]


def poster(arm: Arm, snapshot: Snapshot, eye: Eye) -> bytes:
    """A PNG file of one moment, seen as the clip begins: arm, bodies, points, closest pair."""
    camera = _Camera(eye)
    colour, depth = camera.background(snapshot)
    for T_base_mesh, mesh, paint in _meshes(arm, snapshot):
        camera.draw(mesh, T_base_mesh, paint, colour, depth)
    kept = snapshot.cloud.points[snapshot.cloud.verdict == Verdict.KEPT]
    camera.dots(snapshot.memory, REMEMBERED, 2, colour, depth)
    camera.dots(kept, POINT[Verdict.KEPT], 3, colour, depth)
    pairs, i = snapshot.pairs, snapshot.pairs.closest
    if i >= 0:
        line = np.linspace(pairs.on_world[i], pairs.on_robot[i], 60)
        camera.dots(line, activation_colour(snapshot.command.activation), 3, colour, depth)
    width, height = SIZE
    fine = colour.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3))
    return png((SHADES * np.round(fine / SHADES)).clip(0, 255).astype(np.uint8))


def png(pixels: Picture) -> bytes:
    """The file of pixels (height, width, 3)."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    rows[1:, 1:] -= pixels.reshape(height, -1)[:-1]  # each row as its difference to the one above
    rows[1:, 0] = 2

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(rows.tobytes(), 9)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (chunk(b"IHDR", head), chunk(b"IDAT", body), chunk(b"IEND", b""))
    )


class _Camera:
    """A ray a fine pixel, all from one place; colour (H, W, 3) and depth (H, W) are drawn into."""

    def __init__(self, eye: Eye) -> None:
        self.width, self.height = (FINER * n for n in SIZE)
        self.eye = np.asarray(eye.position, dtype=np.float64)
        ahead = eye.target - self.eye
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        self.axes = np.array([right, np.cross(ahead, right), ahead])  # rows: right, down, ahead
        self.focal = 0.5 * self.height / np.tan(0.5 * FOV)
        u = np.arange(self.width) - 0.5 * (self.width - 1)
        v = np.arange(self.height) - 0.5 * (self.height - 1)
        grid = np.stack(np.broadcast_arrays(u, v[:, None], self.focal), axis=-1)
        rays = grid.reshape(-1, 3) @ self.axes
        self.rays: Array = rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def background(self, snapshot: Snapshot) -> tuple[Array, Array]:
        """Sky, and the ground where the lowest thing stands."""
        share = np.linspace(0.0, 1.0, self.height)[:, None, None]
        colour = np.broadcast_to(SKY[0] + share * (SKY[1] - SKY[0]), (self.height, self.width, 3))
        colour = colour.reshape(-1, 3).copy()
        lows = [
            float((p.view.vertices @ p.T_base_body[2, :3]).min() + p.T_base_body[2, 3])
            for p in snapshot.world
        ]
        down = np.minimum(self.rays[:, 2], -1e-6)
        t = (min([0.0, *lows]) - 0.002 - self.eye[2]) / down
        near = (self.rays[:, 2] < 0.0) & (t > 0.0)
        fade = np.exp(-0.18 * t[near])[:, None]
        colour[near] = fade * GROUND + (1.0 - fade) * colour[near]
        return colour, np.where(near, t, np.inf)

    def draw(
        self, mesh: RigidMesh, T_base_mesh: Array, paint: RGB, colour: Array, depth: Array
    ) -> None:
        """One mesh in one colour, where nothing is nearer."""
        R, p = T_base_mesh[:3, :3], T_base_mesh[:3, 3]
        centre = R @ mesh.centre + p - self.eye
        far = float(np.linalg.norm(centre))
        rows = np.arange(len(self.rays))
        if far > mesh.radius:  # else the eye is within
            edge = np.sqrt(1.0 - (mesh.radius / far) ** 2)
            rows = np.flatnonzero(self.rays @ (centre / far) > edge - 1e-6)
        if not len(rows):
            return
        origins = np.broadcast_to((self.eye - p) @ R, (len(rows), 3)).astype(np.float32)
        t, face, normal = mesh.meet(origins, (self.rays[rows] @ R).astype(np.float32))
        hit = (face >= 0) & (t < depth[rows])
        rows, t, n = rows[hit], t[hit], normal[hit] @ R.T
        n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
        n *= -np.sign((n * self.rays[rows]).sum(axis=1, keepdims=True))  # towards the eye
        light = 0.72 + 0.30 * np.maximum(n @ SUN, 0.0) + 0.10 * n[:, 2]
        colour[rows] = np.asarray(paint, dtype=float) * np.clip(light, 0.0, 1.1)[:, None]
        depth[rows] = t

    def dots(self, points: Array, paint: RGB, half: int, colour: Array, depth: Array) -> None:
        """Squares of 2 half + 1 fine pixels, where nothing is nearer."""
        away = points - self.eye
        x, y, z = (away @ self.axes.T).T
        before = z > 0.05
        far = np.linalg.norm(away, axis=1)
        u = np.round(self.focal * x / np.where(before, z, 1.0) + 0.5 * (self.width - 1))
        v = np.round(self.focal * y / np.where(before, z, 1.0) + 0.5 * (self.height - 1))
        for du in range(-half, half + 1):
            for dv in range(-half, half + 1):
                if du * du + dv * dv > half * half + 1:
                    continue
                a, b = u + du, v + dv
                inside = before & (a >= 0) & (a < self.width) & (b >= 0) & (b < self.height)
                rows = (b[inside] * self.width + a[inside]).astype(np.intp)
                free = far[inside] < depth[rows] + 0.03
                colour[rows[free]] = paint


def _meshes(arm: Arm, snapshot: Snapshot) -> Iterator[tuple[Array, RigidMesh, RGB]]:
    """Pose, mesh and colour of every part of the arm and of every body."""
    for link, T_base_link in zip(arm.robot.links, snapshot.T_base_link, strict=True):
        for part in arm.robot.visual(link).geometry.values():
            if len(part.faces):
                yield T_base_link, RigidMesh(part.vertices, part.faces), _paint(part.visual)
    for pose in snapshot.world:
        view = pose.view
        yield pose.T_base_body, RigidMesh(view.vertices, view.faces), view.colour


def _paint(visual: Any) -> RGB:
    """The colour that a mesh has on the whole; glTF's are linear, a screen's are not."""
    material = getattr(visual, "material", None)
    colour = np.asarray((material or visual).main_color, dtype=float)[:3]
    if hasattr(material, "baseColorFactor"):
        colour = 255.0 * (colour / 255.0) ** (1.0 / 2.2)
    r, g, b = (int(c) for c in colour)
    return r, g, b
