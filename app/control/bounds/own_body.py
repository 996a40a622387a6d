"""The arm keeps off itself: every two links that can meet are kept apart."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.bounds.gap_rows import append_gaps
from app.control.bounds.rows import Motion, Sheet, motion
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.gaps import Pieces
from app.control.limits import Step
from app.control.link_gaps import links_within

WITHIN = 0.15  # [m] farther links are no bounds (specification, section 4.5)


class OwnBodyBounds:
    """The bounds of the nearest links."""

    def __init__(self, clearance: Clearance) -> None:
        self._clearance = clearance

    def append(self, now: Situation, step: Step, sheet: Sheet) -> None:
        """Append the nearest."""
        c, moves = self._clearance, motion(now.posture)
        _append(c.pieces, c.pairs, now.params.retreat_speed, moves, step, sheet)


@compiled
def _append(
    pieces: Pieces, pairs: NDArray[np.int64], v_esc: float, moves: Motion, step: Step, sheet: Sheet
) -> None:
    append_gaps(links_within(moves.T_base_link, pieces, pairs, WITHIN), v_esc, moves, step, sheet)
