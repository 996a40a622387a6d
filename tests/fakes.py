"""Small stand-ins that tests share: frames and clouds made by hand."""

from dataclasses import replace

import numpy as np

from app.messages import Cloud, SensorFrame, Verdict
from app.raycast import MISS, Beams, no_hits
from app.robot.skin import build_skin


def cloud_of(points, verdict=None):
    """A cloud of points (n, 3) that are all kept unless said otherwise."""
    n = len(points)
    kept = np.full(n, Verdict.KEPT, dtype=np.uint8)
    return Cloud(
        points=np.asarray(points, dtype=np.float64).reshape(n, 3),
        verdict=kept if verdict is None else verdict,
        link=np.full(n, -1, dtype=np.int16),
        gap=np.full(n, np.inf),
        eps=np.full((n, 2), np.nan),
        stamp=np.zeros(1),
    )


def frame(sensor=0, stamp=0.0, distance=1.0, status=5, targets=1, sequence=0, zones=64):
    """A frame of so many zones with the same value in every zone, or with an array of them."""
    return SensorFrame(
        sensor,
        stamp,
        sequence,
        np.array(np.broadcast_to(distance, zones), dtype=np.float64),
        np.array(np.broadcast_to(status, zones), dtype=np.uint8),
        np.array(np.broadcast_to(targets, zones), dtype=np.uint8),
    )


def first_hits(world, origins, directions):
    """Ray lengths (n,) [m] to the bodies of a world, every ray (n, 3) for itself; inf: nothing."""
    n = len(origins)
    hits = no_hits(np.full(n, MISS), -2)
    first = np.arange(n + 1, dtype=np.int64)
    origins, directions = map(np.ascontiguousarray, (origins, directions))
    world.end_rays(Beams(origins, directions, np.zeros(n), first, directions), hits)
    assert np.array_equal(hits.label == -1, np.isfinite(hits.length))
    return hits.length


def retyped(skin, kind, robot):
    """The skin with sensors of another type at the same places."""
    return build_skin(skin.title, tuple(replace(s, type=kind) for s in skin.sensors), robot)
