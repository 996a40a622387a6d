"""The random numbers of a simulated sensor: one stream a kind of error.

Every frame draws the same count from each stream, so that what a sensor reports depends on the
seed, the sensor and the number of the frame alone. Another sensor that falls silent, or a kind
of error that is switched off, changes none of the others' numbers: trials stay paired.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from app.messages import Array


class Draws(NamedTuple):
    """The random numbers of one frame, (n,) each, uniform in 0..1 but for the normal `noise`.

    detection: is a target found?   status: is it rejected?   junk: what stands where none is.
    stray:     (2, n) is there a return from nothing, and where?
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

    def draw(self, zones: int) -> Draws:
        """The numbers of the next frame of a sensor with so many zones."""
        return Draws(
            self.detection.random(zones),
            self.noise.standard_normal(zones),
            self.status.random(zones),
            self.stray.random((2, zones)),
            self.junk.random(zones),
        )


@cache
def no_draws(zones: int) -> Draws:
    """Where nothing is random."""
    zero = np.zeros(zones)
    return Draws(zero, zero, zero, np.zeros((2, zones)), zero)


def sensor_streams(seed: int, sensor: int) -> Streams:
    """The streams of a sensor: its child of the seed's sequence, and one grandchild each."""
    child = np.random.SeedSequence(seed, spawn_key=(sensor,))
    return Streams(*map(np.random.default_rng, child.spawn(len(Streams._fields))))
