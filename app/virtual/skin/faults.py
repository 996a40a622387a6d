"""What goes wrong on a wire, on purpose: faults of a board, of its clock and of its cable.

bits=1e-4          this share of all bits is flipped
truncate=0.01      this share of packets is cut short
reorder=0.05       this share of packets changes places with the next one
silence=5:2        from second 5 on nothing is said for 2 s; without the 2: for good
drift=100          the board's clock is fast by so many ppm
wrap=10            the board's 32-bit clock wraps after 10 s
frozen=SENSORS     these repeat their first frame
columns=SENSORS    these send the columns of their zones the other way round
ids=SENSOR:SENSOR  these two send each other's id
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from app.errors import SensorError, options
from app.messages import freeze
from app.sensing.wire.raw import RawFrame, rows

WRAP = 1 << 32  # [us]


@dataclass(frozen=True)
class Faults:
    """Shares are of 1, times in seconds, drift in ppm, sensors by index."""

    bits: float = 0.0
    truncate: float = 0.0
    reorder: float = 0.0
    silence: tuple[float, float] = (inf, 0.0)
    drift: float = 0.0
    wrap: float = 0.0
    frozen: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()
    ids: tuple[int, ...] = ()


def parse_faults(text: str, sensors: Callable[[str], tuple[int, ...]]) -> Faults:
    """Faults of a text like `bits=1e-4,drift=100`; `sensors` finds the indices of a name."""
    kinds: dict[str, Callable[[str], Any]] = {
        "bits": _share, "truncate": _share, "reorder": _share, "silence": _span,
        "drift": lambda t: _number(t, -1000.0, 1000.0), "wrap": lambda t: _number(t, 0.0, 4294.0),
        "frozen": sensors, "columns": sensors,
        "ids": lambda t: tuple(k for name in t.split(":") for k in sensors(name)),
    }  # fmt: skip
    given: dict[str, Any] = {}
    for entry in filter(None, text.split(",")):
        name, _, value = entry.strip().partition("=")
        if name not in kinds:
            raise SensorError(f"no fault {name!r}; {options(name, kinds)}")
        try:
            given[name] = kinds[name](value)
        except ValueError as e:
            raise SensorError(f"fault {name} = {value!r}: {e}") from e
    faults = Faults(**given)
    if faults.ids and len(faults.ids) != 2:
        raise SensorError(f"fault ids names {len(faults.ids)} sensors; give two, as SENSOR:SENSOR")
    return faults


class FaultyWire:
    """Applies faults, seeded; `start` is when the board was switched on [s]."""

    def __init__(self, faults: Faults, start: float, seed: int = 0) -> None:
        self._faults, self._start = faults, start
        self._random = np.random.default_rng(seed)
        self._first: dict[int, RawFrame] = {}
        self._held = b""

    def clock(self, now: float) -> int:
        """The board's 32-bit clock [us]."""
        f = self._faults
        ran = round((now - self._start) * (1e6 + f.drift))
        return (ran - round(f.wrap * 1e6)) % WRAP if f.wrap else ran % WRAP

    def frame(self, frame: RawFrame) -> RawFrame:
        """What the board makes of a frame."""
        f, k = self._faults, frame.sensor
        if k is None:
            return frame
        if k in f.frozen:
            first = self._first.setdefault(k, frame)
            frame = replace(frame, distance=first.distance, status=first.status)
        if k in f.columns:
            frame = mirrored(frame)
        if k in f.ids:
            frame = replace(frame, sensor=f.ids[1 - f.ids.index(k)])
        return frame

    def wire(self, packet: bytes, now: float) -> bytes:
        """What the cable makes of a packet: something else, nothing, or more than one."""
        f, rng = self._faults, self._random
        begin, length = f.silence
        if begin <= now - self._start < begin + length:
            return b""
        if f.truncate and rng.random() < f.truncate:
            packet = packet[: int(rng.integers(len(packet)))]
        if f.bits:
            bits = np.frombuffer(packet, np.uint8).copy()
            flips = rng.integers(8 * max(len(bits), 1), size=rng.poisson(8 * len(bits) * f.bits))
            np.bitwise_xor.at(bits, flips // 8, (1 << (flips % 8)).astype(np.uint8))
            packet = bits.tobytes()
        if f.reorder and not self._held and rng.random() < f.reorder:
            self._held = packet
            return b""
        held, self._held = self._held, b""
        return packet + held


def mirrored(frame: RawFrame) -> RawFrame:
    """The same frame with every row's columns the other way round."""
    distance, status = rows(frame, mirrored=True)
    return replace(frame, distance=freeze(distance.ravel()), status=freeze(status.ravel()))


def _number(text: str, low: float, high: float) -> float:
    value = float(text)
    if not low <= value <= high:
        raise ValueError(f"give a number from {low:g} to {high:g}")
    return value


def _share(text: str) -> float:
    return _number(text, 0.0, 1.0)


def _span(text: str) -> tuple[float, float]:
    begin, _, length = text.partition(":")
    return _number(begin, 0.0, inf), _number(length, 0.0, inf) if length else inf
