"""What the skin sees, one point cloud for each verdict.

A changed count makes the browser allocate anew and a changed colour makes it build a new
material, so every cloud has all the slots of the skin and one colour for ever; slots of
another verdict are parked on a point of this one. Hidden clouds are not sent.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import viser
from numpy.typing import NDArray

from app.messages import Array, Snapshot, Verdict
from app.ui.colours import POINT, RAW, RGB
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.scene.switch import Sign, Switch

PERIOD = 0.06  # [s]: a sensor speaks every 67 ms
Mask = NDArray[np.bool_]

BELIEVED = (Verdict.KEPT, Verdict.CONTACT)  # shown at first

WORDS: dict[Verdict | None, tuple[str, str]] = {  # label and help of the switch
    None: ("All points", "every zone that has a distance"),
    Verdict.KEPT: ("Kept points", "points of the world: believed, and avoided"),
    Verdict.SELF: ("Self points", "thrown away: the robot's own body"),
    Verdict.BEHIND: ("Points behind", "thrown away: farther than the body in the ray's way"),
    Verdict.STATIC: ("Static points", "thrown away: the known or learned static cell"),
    Verdict.BAD_STATUS: ("Bad status", "thrown away: the sensor itself distrusts it"),
    Verdict.OUT_OF_RANGE: ("Out of range", "thrown away: too near or too far"),
    Verdict.STALE: ("Stale points", "thrown away: too old"),
    Verdict.GHOST: ("Ghosts", "waiting: seen by one zone in one frame only"),
    Verdict.CONTACT: ("Contacts", "at a lens, too near to measure: avoided until seen to leave"),
}


@dataclass
class _Class:
    """One cloud; `verdict` None is every slot that has a distance."""

    handle: viser.PointCloudHandle
    verdict: Verdict | None
    on: bool


class CloudView:
    """One cloud a verdict, and one of all measured points."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        slots = engine.skin.slots

        def cloud(name: str, colour: RGB, size: float) -> viser.PointCloudHandle:
            return server.scene.add_point_cloud(
                f"/cloud/{name}",
                np.zeros((slots, 3), dtype=np.float32),
                colour,
                point_size=size,
                point_shape="circle",
                precision="float32",
                visible=False,
            )

        self._pace = Every(PERIOD)
        self._classes = [_Class(cloud("raw", RAW, 0.004), None, False)]
        for verdict, colour in POINT.items():
            believed = verdict in BELIEVED
            size = 0.008 if believed else 0.006
            handle = cloud(verdict.name.lower(), colour, size)
            self._classes.append(_Class(handle, verdict, believed))

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        points, verdict = snapshot.cloud.points, snapshot.cloud.verdict
        measured: Mask = np.isfinite(points[:, 0])
        for c in self._classes:
            mine = measured & (verdict == c.verdict) if c.verdict is not None else measured
            shown = c.on and bool(mine.any())
            if shown:
                c.handle.points = parked(points, mine)
            c.handle.visible = shown

    def shown(self) -> set[Verdict]:
        """The verdicts whose points are drawn."""
        on = {c.verdict for c in self._classes if c.on}
        return set(Verdict) if None in on else {v for v in on if v is not None}

    def switches(self) -> list[Switch]:
        out = []
        for c in self._classes:
            label, words = WORDS[c.verdict]
            seen = c.verdict is not None and c.verdict in BELIEVED
            sign = Sign(POINT[c.verdict]) if seen and c.verdict is not None else None
            out.append(Switch(label, c.on, partial(setattr, c, "on"), words, sign))
        return out


def parked(points: Array, mine: Mask) -> NDArray[np.float32]:
    """(S, 3) float32: rows of `mine` as they are, all others on the first of them."""
    first = points[int(np.argmax(mine))]
    return np.where(mine[:, None], points, first).astype(np.float32)
