"""Who moved into whom when the arm touched something.

While a link is near a body, the nearest points of both and the direction between them are noted.
When they touch, the link's noted point has moved with the link since the moment before; its way
along the noted direction, over the time, is the arm's own part in it.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.judge.truth import TrueDistance
from app.messages import Array, Snapshot
from app.world.world import World

NEAR = 0.03  # [m] nearer pairs are followed
MOVES_INTO = 0.02  # [m/s] slower is not called moving


@dataclass(frozen=True)
class Touch:
    """When [s], by which link, of what, and the touched point's own speed towards it [m/s]."""

    at: float
    link: int
    body: str
    speed: float


@dataclass
class TouchJudge:
    """Watches `links` (rows of the robot's body links) and all of a world but `leave_out`."""

    truth: TrueDistance
    links: NDArray[np.intp]
    world: World
    leave_out: list[str]
    least: float = np.inf  # [m]
    touches: list[Touch] = field(default_factory=list)
    _near: dict[int, tuple[str, Array, Array]] = field(default_factory=dict)
    _T: Array | None = None  # (L, 4, 4) of the moment before
    _stamp: float = 0.0  # [s] of it
    _in: set[int] = field(default_factory=set)  # links that touch

    def update(self, s: Snapshot) -> None:
        """Judge one moment."""
        found = self.truth.nearest(s.T_base_link, self.world, self.leave_out, s.world)
        for i in self.links.tolist():
            distance, body = found[i]
            self.least = min(self.least, distance)
            if distance > 0.0:
                self._in.discard(i)
                self._near.pop(i, None)
                if distance < NEAR:
                    on_link, on_body = self.truth.nearest_points(i, s, self.world, body)
                    self._near[i] = body, on_link, (on_body - on_link) / distance
            elif i not in self._in:
                self._in.add(i)
                self.touches.append(Touch(s.stamp, i, body, self._own_speed(i, s)))
        self._T, self._stamp = s.T_base_link, s.stamp

    def moved_into(self) -> list[Touch]:
        """The touches that are the arm's own."""
        return [t for t in self.touches if t.speed > MOVES_INTO]

    def _own_speed(self, i: int, s: Snapshot) -> float:
        """+inf where it was not near a moment before: nobody has seen how it came there."""
        if i not in self._near or self._T is None:
            return np.inf
        _, point, towards = self._near[i]
        before, now = self._T[i], s.T_base_link[i]
        moved = now @ np.linalg.inv(before) @ np.append(point, 1.0)
        return float((moved[:3] - point) @ towards / (s.stamp - self._stamp))
