"""What a person has clicked: a sensor, and maybe one of its zones. One for all pages."""

from collections.abc import Callable, Collection

import numpy as np

from app.messages import Array, Snapshot, Verdict
from app.robot.skin import Skin
from app.ui.picking import pick_point, pick_sensor

NOBODY = -1


class Chosen:
    """The choice, and how a click in the scene changes it. `sensor` is NOBODY for none."""

    def __init__(self, skin: Skin) -> None:
        self.sensor, self.slot = NOBODY, NOBODY
        self.changed: list[Callable[[], None]] = []  # called after every change
        self._skin = skin

    def take_sensor(self, k: int) -> None:
        """Choose sensor k, NOBODY for none, and no zone of it."""
        self._take(k, NOBODY)

    def take_zone(self, slot: int) -> None:
        """Choose the zone in this slot, and its sensor."""
        self._take(int(self._skin.sensor_of[slot]), slot)

    def click(
        self, origin: Array, direction: Array, snapshot: Snapshot, shown: Collection[Verdict]
    ) -> None:
        """A ray into the scene: the point of a shown verdict or the sensor that is nearest to it;
        where neither is near, no zone is chosen any more."""
        cloud = snapshot.cloud
        if not np.any(direction):
            return
        mask = np.isin(cloud.verdict, [int(v) for v in shown])
        slot, off = pick_point(origin, direction, cloud.points, mask)
        k, aside = pick_sensor(origin, direction, snapshot.T_base_link, self._skin)
        if slot >= 0 and off <= aside:
            self.take_zone(slot)
        elif k >= 0:
            self.take_sensor(k)
        else:
            self._take(self.sensor, NOBODY)

    def _take(self, sensor: int, slot: int) -> None:
        self.sensor, self.slot = sensor, slot
        for told in self.changed:
            told()
