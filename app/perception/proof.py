"""Whether a sensor that returns nothing is to be believed: does it see what it must see?

No return is honest emptiness, a dead receiver or something black before the window. Two things
tell them apart. The arm's own body: where it is well in the way of a zone and near, that zone has
to return something; a sensor of which hardly any such zone does, `MISSED` frames in a row, is dark.
And what it has just seen: a surface in `MANY` zones, not near enough to slip out of the view
between two frames nor so far that it may fade, does not vanish from all zones at once. A dark
sensor is believed again as soon as `AGAIN` of its zones return something, or those that must.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.perception.placing import Lenses, Reports
from app.perception.returns import Judgement
from app.perception.unable import Unable
from app.robot.skin import Skin
from app.robot.traits import NOTHING, TRUSTED

BODY = 0.3  # [m] an own body nearer than this is seen whatever it is made of
FEW = 6  # zones with the body in their way that make a frame tell
HARDLY = 0.8  # of them return nothing
MISSED = 5  # frames in a row
# [m] a surface between these stays from frame to frame: at the nearer end a view of 45 degrees is
# 25 cm wide, which is 3.7 m/s at 15 Hz
STAYS = (0.3, 1.2)
MANY, AGAIN = 8, 4  # zones; a stray return of one or two is no sight
SEES, DARK = int(Unable.SEES), int(Unable.DARK)


class Evidence(NamedTuple):
    """Of K sensors: missed frames in a row; zones with a surface that stays in the last frame;
    unable: (K,) of `Unable`."""

    missed: NDArray[np.int64]
    before: NDArray[np.int64]
    unable: NDArray[np.uint8]


class Proof:
    """Which sensors have gone dark."""

    def __init__(self, skin: Skin) -> None:
        self._count = skin.count
        self.reset()

    def reset(self) -> None:
        """Nothing has been seen or missed."""
        K = self._count
        missed, before = np.zeros(K, dtype=np.int64), np.zeros(K, dtype=np.int64)
        self._evidence = Evidence(missed, before, np.zeros(K, dtype=np.uint8))

    @property
    def unable(self) -> NDArray[np.uint8]:
        """(K,) of `Unable`: dark, or seeing."""
        return self._evidence.unable

    def weigh(
        self, sensors: NDArray[np.intp], reports: Reports, lenses: Lenses, judged: Judgement
    ) -> None:
        """Take note of the newest frames of `sensors` (m,), as the self filter has judged them."""
        _weigh(sensors, reports, lenses, judged, self._evidence)


@compiled
def _weigh(
    sensors: NDArray[np.intp], reports: Reports, lenses: Lenses, judged: Judgement, known: Evidence
) -> None:
    for k in sensors:
        first, last = lenses.first[k], lenses.first[k + 1]
        must, missing, seen, nothing, stays = 0, 0, 0, 0, 0
        for slot in range(first, last):
            z, worth = reports.distance[slot], lenses.worth[k, reports.status[slot]]
            empty = reports.targets[slot] == 0 or worth == NOTHING
            nothing += empty
            if not empty and worth == TRUSTED:
                seen += 1
                stays += STAYS[0] < z < STAYS[1]
            body = judged.gap[slot] + z
            if judged.link[slot] >= 0 and not judged.edge[slot]:
                inside = lenses.limits[k, 0] <= body <= BODY
                must += inside
                missing += inside and empty
        proven = must >= FEW and missing < HARDLY * must
        if must >= FEW:
            known.missed[k] = 0 if proven else known.missed[k] + 1
        vanished = nothing == last - first and known.before[k] >= MANY
        if known.missed[k] >= MISSED or vanished:
            known.unable[k] = DARK
        elif proven or seen >= AGAIN:
            known.unable[k] = SEES
        known.before[k] = stays
