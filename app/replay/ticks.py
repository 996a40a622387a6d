"""Numbers of ticks and places in a recording: they differ where it begins late or has gaps."""

import numpy as np
from numpy.typing import NDArray

from app.record.recording import Recording


def ticks_of(recording: Recording) -> NDArray[np.intp]:
    """(N,) `Inputs.tick` of each."""
    if not recording.dropped:
        return recording.head.first_tick + np.arange(len(recording))
    return np.array([recording.inputs(i).tick for i in range(len(recording))], dtype=np.intp)
