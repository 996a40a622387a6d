"""One RTDE client of the virtual controller: recipes in, states out. No socket here."""

import struct

from app.robot.ur.wire import (
    Kind,
    Packet,
    WireError,
    names,
    output_setup,
    pack,
    pack_values,
    unpack_values,
)
from app.virtual.ur.controller import UrController
from app.virtual.ur.variables import IN_USE, INPUTS, NOT_FOUND, OUTPUTS

PROTOCOL = 2
RECIPES = 255


class RtdeClient:
    """What the controller knows of one connection; `owners` is shared by all of them."""

    def __init__(self, controller: UrController, owners: dict[str, "RtdeClient"]) -> None:
        self._controller, self._owners = controller, owners
        self._outputs: list[str] = []
        self._types: list[str] = []
        self._inputs: list[tuple[list[str], list[str]]] = []
        self._every = 1
        self._cycle = 0
        self.started = False

    def take(self, packet: Packet) -> bytes:
        """The answer to a packet, empty for a data packet; WireError for what is no RTDE."""
        kind, payload = packet
        match kind:
            case Kind.VERSION:
                if len(payload) != 2:
                    raise WireError("a protocol version has 2 bytes")
                return pack(kind, bytes([payload == struct.pack(">H", PROTOCOL)]))
            case Kind.CONTROLLER:
                return pack(kind, struct.pack(">4I", *self._controller.version))
            case Kind.OUTPUTS:
                return pack(kind, b"\x01" + self._choose_outputs(payload))
            case Kind.INPUTS:
                return pack(kind, self._add_inputs(names(payload)))
            case Kind.START:
                self.started = bool(self._outputs) and NOT_FOUND not in self._types
                return pack(kind, bytes([self.started]))
            case Kind.PAUSE:
                self.started = False
                return pack(kind, b"\x01")
            case Kind.DATA:
                self._write(payload)
                return b""
        raise WireError(f"a packet of kind {kind} is not known here")

    def data(self) -> bytes:
        """The data packet of this cycle; empty when none is due."""
        self._cycle += 1
        if not self.started or self._cycle % self._every:
            return b""
        values = [self._controller.read(name) for name in self._outputs]
        return pack(Kind.DATA, b"\x01" + pack_values(self._types, values))

    def leave(self) -> None:
        """Give back the input variables."""
        for name in [n for n, owner in self._owners.items() if owner is self]:
            del self._owners[name]

    def _choose_outputs(self, payload: bytes) -> bytes:
        rate, self._outputs = output_setup(payload)
        self._every = max(1, round(500.0 / rate))
        self._types = [OUTPUTS.get(name, NOT_FOUND) for name in self._outputs]
        return ",".join(self._types).encode()

    def _add_inputs(self, wanted: list[str]) -> bytes:
        types = [INPUTS.get(name, NOT_FOUND) for name in wanted]
        for i, name in enumerate(wanted):
            if self._owners.get(name, self) is not self:
                types[i] = IN_USE
        usable = NOT_FOUND not in types and IN_USE not in types
        if not usable or len(self._inputs) == RECIPES:
            return b"\x00" + ",".join(types).encode()
        self._inputs.append((wanted, types))
        self._owners.update(dict.fromkeys(wanted, self))
        return bytes([len(self._inputs)]) + ",".join(types).encode()

    def _write(self, payload: bytes) -> None:
        recipe = payload[0] if payload else 0
        if not 1 <= recipe <= len(self._inputs):
            raise WireError(f"input recipe {recipe} was not set up")
        wanted, types = self._inputs[recipe - 1]
        self._controller.write(dict(zip(wanted, unpack_values(types, payload[1:]), strict=True)))
