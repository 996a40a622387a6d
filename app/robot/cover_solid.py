r"""The shape of a printed cover: a ring round a link, with a window over every sensor.

               _____     rim: `rim` beyond the lenses
             _/     \_
          __/ \_|_|_/ \__    a window: its floor lies `floor` below the lens
         |_______________|   foot: on the link, with some play
               link

A window opens at 45 degrees, which clears a square field of view of up to 80 degrees a side.
Solids are millimetres, shapes and files metres.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from manifold3d import Manifold

from app.robot.covers import CoverShape
from app.robot.solids import (
    BODY,
    VISUAL,
    Detail,
    Materials,
    Part,
    frame,
    lathe,
    write_body,
    write_visual,
)

CHIP = (3.2, 1.5, 0.5)  # [mm] half sizes of a VL53L8CX and its height above the floor
RISE = 10.0  # [mm] that a window is cut beyond its floor: through every rim
MATERIALS: Materials = {
    "print": ((66, 71, 78), 0.0, 0.7),
    "chip": ((14, 15, 18), 0.1, 0.25),
}


def write_covers(shapes: Sequence[CoverShape], body: Path, visual: Path) -> tuple[int, int]:
    """Write the covers of one link into two files; the bytes shown and the faces measured."""
    shown = [part for shape in shapes for part in _placed(shape, VISUAL)]
    solid = [part for shape in shapes for part in _placed(shape, BODY)]
    return write_visual(shown, visual, MATERIALS), write_body(solid, body)


def _placed(shape: CoverShape, detail: Detail) -> list[Part]:
    place = frame([1e3 * c for c in shape.centre], shape.start, shape.axis)
    return [Part(p.material, p.solid, None, place) for p in cover(shape, detail)]


def cover(shape: CoverShape, detail: Detail) -> list[Part]:
    """One cover in its ring's frame: w along the axis, the first sensor along u."""
    rim, foot = 1e3 * shape.lens + 1e3 * shape.rim, 1e3 * shape.foot_half_width
    land = 1e3 * shape.land_half_width
    profile = [(-foot, 1e3 * shape.foot_radius), (-land - 1, rim - 1), (-land, rim)]
    profile += [(-w, r) for w, r in reversed(profile)]
    inner = 1e3 * shape.inner
    body = lathe(profile, detail) - lathe([(-foot - 1, inner), (foot + 1, inner)], detail)
    turns = [(0, 0, 360 * k / shape.windows) for k in range(shape.windows)]
    for turn in turns:
        body -= _window(shape).rotate(turn)
    parts = [Part("print", body)]
    if detail.ornaments:
        parts += [Part("chip", _chip(shape).rotate(turn)) for turn in turns]
    return parts


def _window(shape: CoverShape) -> Manifold:
    """A recess under the first lens, flaring outward at 45 degrees."""
    floor, points = 1e3 * shape.lens - 1e3 * shape.floor, []
    for rise in (0.0, RISE):
        v, w = (1e3 * half + rise for half in shape.window_half)
        points += [(floor + rise, a * v, b * w) for a in (-1, 1) for b in (-1, 1)]
    return _tilted(Manifold.hull_points(np.array(points)), shape)


def _chip(shape: CoverShape) -> Manifold:
    """The sensor on the recess's floor; its lens is just above it."""
    v, w, height = CHIP
    floor = 1e3 * shape.lens - 1e3 * shape.floor
    chip = Manifold.cube((height + 1, 2 * v, 2 * w)).translate((floor - 1, -v, -w))
    return _tilted(chip, shape)


def _tilted(solid: Manifold, shape: CoverShape) -> Manifold:
    """What belongs to the first sensor, turned about its lens by the sensors' tilt."""
    if not shape.tilt:
        return solid
    lens = 1e3 * shape.lens
    turned = solid.translate((-lens, 0, 0)).rotate((0, -shape.tilt, 0))
    return turned.translate((lens, 0, 0))
