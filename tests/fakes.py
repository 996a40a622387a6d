"""Small stand-ins that tests share: frames and clouds made by hand."""

import numpy as np

from app.messages import Cloud, SensorFrame, Verdict


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


def frame(sensor=0, stamp=0.0, distance=1.0, status=5, targets=1, sequence=0):
    """A frame with the same value in every zone, or with an array of 64."""
    return SensorFrame(
        sensor,
        stamp,
        sequence,
        np.array(np.broadcast_to(distance, 64), dtype=np.float64),
        np.array(np.broadcast_to(status, 64), dtype=np.uint8),
        np.array(np.broadcast_to(targets, 64), dtype=np.uint8),
    )
