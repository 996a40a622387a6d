"""The arm keeps out of the known cell, seen or not."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.bounds.gap_rows import append_gaps
from app.control.bounds.rows import Motion, Sheet, motion
from app.control.cell_gaps import Parts, cell_within
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.gaps import Pieces
from app.control.limits import Step

WITHIN = 0.3  # [m] farther parts are no bounds; a stretched arm can come fast


class CellBounds:
    """The bounds of the nearest parts of the cell."""

    def __init__(self, clearance: Clearance) -> None:
        self._clearance = clearance

    def append(self, now: Situation, step: Step, sheet: Sheet) -> None:
        """Append the nearest."""
        c, moves = self._clearance, motion(now.posture)
        _append(c.pieces, c.cell_cases, c.parts, now.params.retreat_speed, moves, step, sheet)


@compiled
def _append(
    pieces: Pieces, cases: NDArray[np.int64], parts: Parts, v_esc: float, moves: Motion,
    step: Step, sheet: Sheet,
) -> None:  # fmt: skip
    gaps = cell_within(moves.T_base_link, pieces, cases, parts, WITHIN)
    append_gaps(gaps, v_esc, moves, step, sheet)
