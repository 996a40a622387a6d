"""The parts of a drawn truth, each with a stream of random numbers of its own.

Switching one part off leaves the draws of all others as they are.
"""

from enum import IntEnum

import numpy as np

TRUTH = 1 << 20  # sensors' own streams, see `app.sensing.streams`, have smaller keys


class Part(IntEnum):
    """Streams of random numbers; a number never changes its meaning."""

    MOUNTING = 0
    KINEMATICS = 1
    TIME = 2
    BODY = 3
    REFLECTANCE = 4
    COVER = 5
    ZONES = 6


def stream(seed: int, part: Part, *key: int) -> np.random.Generator:
    """The random numbers of a part, or of one thing in it."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(TRUTH, part, *key)))
