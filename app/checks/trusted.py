"""Which zones of a measurement count when a skin is checked or calibrated."""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, SensorFrame
from app.sensing.replay import Recording

TRUSTED = (5, 9)  # target statuses: valid, and valid with two pulses merged (UM3109)


def trusted(measured: SensorFrame | Recording) -> NDArray[np.bool_]:
    """Zones (64,) of a frame, or (F, 64) of a recording, that saw something and are sure of it."""
    return np.asarray((measured.targets > 0) & np.isin(measured.status, TRUSTED))


def trusted_depth(measured: SensorFrame | Recording) -> Array:
    """Their depths [m], NaN in all other zones."""
    return np.where(trusted(measured), measured.distance, np.nan)
