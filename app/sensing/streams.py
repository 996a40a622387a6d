"""The random numbers of a simulated sensor: one stream a kind of error.

Every frame draws the same count from each stream, so that what a sensor reports depends on the
seed, the sensor and the number of the frame alone. Another sensor that falls silent, or a kind
of error that is switched off, changes none of the others' numbers: trials stay paired.
"""

from typing import NamedTuple

import numpy as np

from app.messages import SLOTS, Array


class Draws(NamedTuple):
    """The random numbers of one frame, (64,) each, uniform in 0..1 but for the normal `noise`.

    detection: is a target found?   status: is it rejected?   junk: what stands where none is.
    stray:     (2, 64) is there a return from nothing, and where?
    """

    detection: Array
    noise: Array
    status: Array
    stray: Array
    junk: Array


class Streams(NamedTuple):
    """One generator a kind of error of one sensor: `bias` for good, the rest for every frame."""

    bias: np.random.Generator
    detection: np.random.Generator
    noise: np.random.Generator
    status: np.random.Generator
    stray: np.random.Generator
    junk: np.random.Generator

    def draw(self) -> Draws:
        """The numbers of the sensor's next frame."""
        return Draws(
            self.detection.random(SLOTS),
            self.noise.standard_normal(SLOTS),
            self.status.random(SLOTS),
            self.stray.random((2, SLOTS)),
            self.junk.random(SLOTS),
        )


_ZERO = np.zeros(SLOTS)
NOTHING = Draws(_ZERO, _ZERO, _ZERO, np.zeros((2, SLOTS)), _ZERO)  # where nothing is random


def sensor_streams(seed: int, sensor: int) -> Streams:
    """The streams of a sensor: its child of the seed's sequence, and one grandchild each."""
    child = np.random.SeedSequence(seed, spawn_key=(sensor,))
    return Streams(*map(np.random.default_rng, child.spawn(len(Streams._fields))))
