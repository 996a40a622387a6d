"""A real skin on one or several serial ports.

Frames are stamped by their ports' readers; here they find their sensors, in the thread that
polls, and whatever a port is not trusted for is refused with a named state.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.messages import SensorFrame, freeze
from app.robot.posture import Posture
from app.robot.sensor_type import SensorType
from app.robot.skin import Skin
from app.sensing.latency import latency, latency_words
from app.sensing.port import PortFacts, Tap
from app.sensing.port_spec import PortSpec
from app.sensing.port_state import PortState, PortWatch, rate_words, words
from app.sensing.rate import slow_words
from app.sensing.stream import Arrival
from app.sensing.wire.detect import format_of
from app.sensing.wire.raw import NO_TARGET, RawFrame

HANDOVER = 1.0  # [s] of silence after which another port may speak for a sensor
STALL = 0.2  # [s] between two polls: then it is this machine that was silent
STATELESS = "no status: what is within the sensor's range counts as valid"


class Wire(Protocol):
    """What is needed of a port."""

    name: str
    tap: Tap | None

    def receive(self) -> list[Arrival]: ...
    def facts(self) -> PortFacts: ...
    def close(self) -> None: ...


class SerialSkin:
    """Frames of `skin` from open ports; `specs` say what each port may speak for."""

    def __init__(self, skin: Skin, ports: Sequence[Wire], specs: Sequence[PortSpec]) -> None:
        self.name = "serial " + ", ".join(p.name for p in ports)
        self._skin, self._ports, self._specs = skin, tuple(ports), tuple(specs)
        self._names = [s.name for s in skin.sensors]
        self._watches = tuple(PortWatch() for _ in ports)
        self._claims = {k: i for i, spec in enumerate(specs) for k in spec.sensors}
        self._owner = dict(self._claims)
        self._heard = np.full(skin.count, -np.inf)
        self._sequence = np.zeros(skin.count, dtype=np.int64)
        self._polled: float | None = None
        self._since = float("-inf")  # from here on silence is counted

    @property
    def ports(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(p.name for p in self._ports)

    @property
    def connected(self) -> NDArray[np.bool_]:
        """(K,) sensors that a port claims or has spoken for."""
        mask = np.zeros(self._skin.count, dtype=bool)
        mask[list(self._owner)] = True
        return mask

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames that the readers have put down since the last call."""
        stalled = self._polled is None or now - self._polled > STALL
        if stalled:
            self._since = now
        self._polled = now
        frames = []
        for i, (port, watch) in enumerate(zip(self._ports, self._watches, strict=True)):
            for arrival in port.receive():
                if stalled and now - arrival.arrived > STALL:
                    continue  # what has piled up meanwhile is of no use to anybody
                frame = self._accept(i, arrival, now)
                if frame is not None:
                    frames.append(frame)
            watch.count(port.facts())
        return frames

    def overhear(self, tap: Tap) -> None:
        """Tell `tap` of all bytes that are taken from now on, before they are decoded."""
        for port in self._ports:
            port.tap = tap

    def ended(self) -> str:
        """A port that is gone may come back."""
        return ""

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """The first port that somebody relies on and cannot."""
        for i, state in enumerate(self._states(now, silence)):
            fine = state in (PortState.GOOD, PortState.NOISY)
            begins = state is PortState.WAITING and now - self._since <= silence
            if not (fine or begins) and self._relied_on(i, used):
                port = self._ports[i]
                return words(port.name, state, port.facts(), self._watches[i], now)
        return ""

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """Every port with its state and its figures."""
        out = []
        for i, state in enumerate(self._states(now, STALL)):
            port, watch = self._ports[i], self._watches[i]
            facts = port.facts()
            line = rate_words(facts, state, watch)
            if facts.format:
                told = latency_words(self._specs[i], watch.latency, self._skin.late)
                missing = "" if format_of(facts.format).status else STATELESS
                slow = slow_words(facts.rate)
                line = " · ".join(part for part in (line, told, missing, slow) if part)
            out.append((port.name, line))
        return tuple(out)

    def close(self) -> None:
        """End the readers."""
        for port in self._ports:
            port.close()

    def _states(self, now: float, silence: float) -> list[PortState]:
        return [
            watch.state(port.facts(), now, self._since, silence)
            for port, watch in zip(self._ports, self._watches, strict=True)
        ]

    def _relied_on(self, i: int, used: NDArray[np.bool_]) -> bool:
        """A port matters if one of its sensors does; one that has no sensor yet does as well."""
        sensors = set(self._specs[i].sensors) | self._watches[i].spoken
        return not sensors or bool(used[list(sensors)].any())

    def _accept(self, i: int, arrival: Arrival, now: float) -> SensorFrame | None:
        """The frame of a layout's sensor, or None with the port's refusal noted."""
        raw, watch = arrival.frame, self._watches[i]
        given = raw.sensor
        if given is not None and self._specs[i].meant:
            given = self._specs[i].meant[given]
        k = self._sensor(i, given, now)
        if k is None:
            return None
        sensor = self._skin.sensors[k]
        if raw.grid != sensor.type.grid:
            (r, c), (rows, columns) = raw.grid, sensor.type.grid
            because = f"{sensor.name} reports {r}x{c} zones, the layout has {rows}x{columns}"
            watch.refuse(PortState.MISFIT, because, now)
            return None
        facts = self._ports[i].facts()
        told = format_of(facts.format).status
        status = _in_codes(raw, sensor.type) if told else _status(raw, sensor.type)
        watch.latency = latency(
            self._specs[i], sensor.type, raw.t_us is not None, arrival.size, facts.baud
        )
        watch.spoken.add(k)
        self._owner[k] = i
        self._heard[k] = now
        self._sequence[k] += 1
        return SensorFrame(
            sensor=k,
            stamp=arrival.stamp - watch.latency,
            sequence=int(self._sequence[k]) if raw.sequence is None else raw.sequence,
            distance=freeze(raw.distance * 1e-3),
            status=status,
            targets=freeze((status != sensor.type.status.no_target).astype(np.uint8)),
        )

    def _sensor(self, i: int, given: int | None, now: float) -> int | None:
        """Index of the sensor that a frame of port i is of."""
        watch, claimed = self._watches[i], self._specs[i].sensors
        names = self._names
        if given is None:
            if len(claimed) == 1:
                return claimed[0]
            because = "its format names no sensor; give one as PORT=SENSOR"
            watch.refuse(PortState.UNASSIGNED, because, now)
            return None
        if given >= len(names):
            because = f"it sends sensor id {given}, the layout has {len(names)} sensors"
            watch.refuse(PortState.MISFIT, because, now)
            return None
        owner = self._claims.get(given)
        if owner not in (None, i) or (claimed and given not in claimed):
            where = f", which {self._ports[owner].name} should" if owner is not None else ""
            because = f"it speaks for {names[given]}{where}; cables or ids are swapped"
            watch.refuse(PortState.SWAPPED, because, now)
            return None
        holder = self._owner.get(given, i)
        if holder != i and now - self._heard[given] <= HANDOVER:
            because = f"it speaks for {names[given]}, and so does {self._ports[holder].name}"
            watch.refuse(PortState.CONFLICT, because, now)
            return None
        return given


def _in_codes(raw: RawFrame, kind: SensorType) -> NDArray[np.uint8]:
    """(n,) statuses as the type has them; on every wire 255 is no target."""
    nothing = kind.status.no_target
    if nothing == NO_TARGET:
        return raw.status
    return freeze(np.where(raw.status == NO_TARGET, nothing, raw.status).astype(np.uint8))


def _status(raw: RawFrame, kind: SensorType) -> NDArray[np.uint8]:
    """(n,) statuses where a format has none: what the sensor can have measured is valid."""
    seen = (raw.distance > 0) & (raw.distance < kind.most_m * 1e3)
    codes = kind.status.valid, kind.status.no_target
    return freeze(np.where(seen, *codes).astype(np.uint8))
