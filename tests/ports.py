"""Stand-ins for ports: one fed by hand on a manual clock, and a pseudo terminal to speak at."""

from math import inf

import numpy as np

from app.sensing.port import PortFacts
from app.sensing.stream import Stream
from app.sensing.wire import binary
from app.sensing.wire.raw import USUAL, RawFrame


def raw(sensor=0, sequence=0, t_us=0, distance=1000, status=5, grid=(8, 8)):
    """A frame with the same value in every zone, or with arrays of all zones."""
    n = grid[0] * grid[1]
    return RawFrame(
        sensor, sequence % (1 << 16), t_us % (1 << 32), grid,
        np.array(np.broadcast_to(distance, n), dtype=np.int16),
        np.array(np.broadcast_to(status, n), dtype=np.uint8), 25,
    )  # fmt: skip


class HandPort:
    """What a port's reader does, done by the test: bytes in, frames out, plugs pulled."""

    def __init__(self, name="/dev/hand", format_name="", grids=USUAL):
        self.name = name
        self._format, self._grids = format_name, grids
        self._taken = []
        self.closed = False
        self.plug()

    def plug(self):
        self.stream = Stream(self._format, self._grids)
        self.open, self.error = True, ""
        self.heard = self.spoke = -inf

    def unplug(self):
        self.open, self.error = False, "unplugged or switched off"

    def hear(self, data, now):
        if not self.open:
            return
        self.heard = now
        arrivals = self.stream.feed(data, now)
        if arrivals:
            self.spoke = now
        self._taken += arrivals

    def say(self, frame, now):
        self.hear(binary.encode(frame), now)

    def receive(self):
        taken, self._taken = self._taken, []
        return taken

    def facts(self):
        s = self.stream
        return PortFacts(
            self.open, s.format, self.heard, self.spoke, s.frames, s.damaged, s.lost,
            s.drift, self.error, 0.0, s.restarts, 0, s.trouble, s.rate, s.clock,
        )  # fmt: skip

    def close(self):
        self.closed = True


def restless(sensor, sequence, t_us):
    """About 1 m before every zone; the same values over and over would be called frozen."""
    return raw(sensor, sequence, t_us, 1000 + sequence % 2)


class Board:
    """Says a frame of each of its sensors 15 times a second, one after the other."""

    def __init__(self, port, sensors, boot_us=0, ppm=0.0, frame=restless):
        self.port, self.sensors, self.frame = port, list(sensors), frame
        self.boot_us, self.ppm = boot_us, ppm
        self.count = 0
        self.quiet = False
        self.garble = lambda packet: packet

    def run(self, now):
        """Say all that is due at `now` [s]; the board was switched on at 0."""
        while self.count / (15.0 * len(self.sensors)) <= now:
            k = self.sensors[self.count % len(self.sensors)]
            t = self.count / (15.0 * len(self.sensors))
            t_us = self.boot_us + round(t * (1e6 + self.ppm))
            if not self.quiet:
                frame = self.frame(k, self.count // len(self.sensors), t_us)
                self.port.hear(self.garble(binary.encode(frame)), t)
            self.count += 1
