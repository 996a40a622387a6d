"""What the skin sees and remembers: one cloud a verdict, in the page's colours.

A point is 16 bytes: x, y, z as float32 and red, green, blue, alpha as bytes, which viewers take
for its colour unasked. A cloud that has become empty is told once as an empty one, or viewers
would go on showing its last points.
"""

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from numpy.typing import NDArray

from app.colours import POINT, REMEMBERED, RGB
from app.messages import Array, Snapshot, Verdict
from app.record.views.values import View, pose_of, time_of

PACKED = np.dtype([("xyz", "<f4", 3), ("rgba", "u1", 4)])
COLOURS = ("red", "green", "blue", "alpha")  # by these names a viewer knows them
MOST = 4096  # remembered points that are told
FLOAT, BYTE = PackedElementField.FLOAT32, PackedElementField.UINT8
FIELDS = [
    *(PackedElementField(name=n, offset=4 * i, type=FLOAT) for i, n in enumerate("xyz")),
    *(PackedElementField(name=n, offset=12 + i, type=BYTE) for i, n in enumerate(COLOURS)),
]
HERE = pose_of(np.eye(4))
TOPICS = {verdict: f"/points/{verdict.name.lower()}" for verdict in POINT}
REMEMBERED_TOPIC = "/points/remembered"
Packed = NDArray[np.void]


class CloudViews:
    """`/points/<verdict>` and `/points/remembered`, in the base frame."""

    def __init__(self, base: str, slots: int) -> None:
        self._base = base
        self._blank = {v: _blank(max(slots, 1), colour) for v, colour in POINT.items()}
        self._memory = _blank(MOST, REMEMBERED)
        self._shown: set[str] = set()  # topics whose last cloud had points

    def of(self, s: Snapshot, at_ns: int) -> list[View]:
        """All clouds with points, and those that had some the last time."""
        points, verdict = s.cloud.points, s.cloud.verdict
        measured = np.flatnonzero(np.isfinite(points[:, 0]))
        points, verdict = points[measured], verdict[measured]
        counts = np.bincount(verdict, minlength=len(Verdict)).tolist()
        out: list[View] = []
        for kind, topic in TOPICS.items():
            if counts[kind]:
                self._tell(out, topic, points[verdict == int(kind)], self._blank[kind], at_ns)
            else:
                self._clear(out, topic, at_ns)
        if len(s.memory):
            thin = s.memory[:: -(-len(s.memory) // MOST)]
            self._tell(out, REMEMBERED_TOPIC, thin, self._memory, at_ns)
        else:
            self._clear(out, REMEMBERED_TOPIC, at_ns)
        return out

    def _tell(self, out: list[View], topic: str, points: Array, blank: Packed, at_ns: int) -> None:
        blank["xyz"][: len(points)] = points
        out.append((topic, cloud(self._base, blank[: len(points)].tobytes(), at_ns)))
        self._shown.add(topic)

    def _clear(self, out: list[View], topic: str, at_ns: int) -> None:
        if topic in self._shown:
            self._shown.discard(topic)
            out.append((topic, cloud(self._base, b"", at_ns)))


def cloud(frame: str, data: bytes, at_ns: int) -> PointCloud:
    """Packed points in a frame."""
    return PointCloud(
        timestamp=time_of(at_ns), frame_id=frame, pose=HERE,
        point_stride=PACKED.itemsize, fields=FIELDS, data=data,
    )  # fmt: skip


def _blank(count: int, colour: RGB) -> Packed:
    """(count,) points of one colour, to be written into."""
    blank = np.zeros(count, dtype=PACKED)
    blank["rgba"] = (*colour, 255)
    return blank
