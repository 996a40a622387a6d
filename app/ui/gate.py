"""The gate: every message of every page passes here first, and most of what could is refused.

    socket ─► size ─► rate ─► a message? ─► one that a hand could send? ─► may this page? ─► viser

viser lets any connected client set any control and drag any handle, so what a page shows
disabled proves nothing; this is the one place where a page's right to act is looked at. What
is no message, or too much, ends that page's connection; what it may not do is dropped, logged
and answered with the true value, so that the page shows again what is. Nothing here waits.
"""

import logging
from collections.abc import Callable
from typing import Any, NoReturn

import viser
from viser import _messages as m
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.typing import Data

from app.timing import Clock
from app.ui.access import Access, words
from app.ui.pacing import Bucket, Every
from app.ui.wire import WATCHING, MalformedError, UnusedError, decoded, misfit

log = logging.getLogger(__name__)
LARGEST = 64 * 1024  # [bytes] of one message; a page's own are below one kilobyte
RATE = 200.0  # [1/s] messages of one page; a hand that drags sends at most 80
BURST = 200.0  # messages of one page at once

Answer = Callable[[int, m.Message, str], None]  # page, what it sent, why it was refused


class Gate:
    """Judges messages by the lease and by the controls of one server."""

    def __init__(self, access: Access, clock: Clock) -> None:
        self.access, self.clock = access, clock
        self.free: set[str] = set()  # controls by uuid that every page may use
        self.refused = 0
        self._server: viser.ViserServer | None = None
        self._answer: Answer | None = None

    def open(self, server: viser.ViserServer, answer: Answer) -> None:
        """Let messages in for `server`; before this none gets through but camera poses.

        `answer` is called for each refused message, on the thread of the socket.
        """
        self._server, self._answer = server, answer

    def page(self, connection: ServerConnection) -> int:
        """The number of the page on `connection`, -1 if viser does not know it yet."""
        known = self._server._websock_server._live_connections if self._server else {}
        return next((page for page, held in known.items() if held is connection), -1)

    def passes(self, page: int, raw: Data) -> str:
        """Empty if viser shall see the message, else why not. Raises `MalformedError`."""
        try:
            message = decoded(raw)
        except UnusedError as e:
            return str(e)
        if isinstance(message, WATCHING):
            self.access.acted(page, self.clock.now())
            return ""
        why = self._misuse(page, message)
        if why and self._answer is not None:
            self._answer(page, message, why)
        return why

    def _misuse(self, page: int, message: m.Message) -> str:
        """Why the page may not send this, empty if it may."""
        name, free = f"{type(message).__name__} on {getattr(message, 'name', '')!r}", False
        if isinstance(message, (m.GuiUpdateMessage, m.CommandTriggerMessage)):
            handle = self.handle(page, message.uuid)
            if handle is None:
                return f"{type(message).__name__} on a control that it does not have"
            free = message.uuid in self.free
            name = f"a use of {handle._impl.props.label!r}"
            if isinstance(message, m.GuiUpdateMessage):
                why = misfit(handle, message.updates)
                if why:
                    return f"{name}: {why}"
        if not free and self.access.operator != page:
            return f"{name}: it watches, {words(self.access.operator)} operates"
        self.access.acted(page, self.clock.now())
        return ""

    def handle(self, page: int, uuid: str) -> Any:
        """The control or command `uuid` as the page has it, None if it has none."""
        if self._server is None:
            return None
        client = self._server._connected_clients.get(page)
        for gui in (self._server.gui, client.gui if client is not None else None):
            if gui is not None:
                found: Any = gui._gui_input_handle_from_uuid.get(uuid)
                found = found or gui._command_handle_from_uuid.get(uuid)
                if found is not None:
                    return found
        return None


class GatedConnection(ServerConnection):
    """A page's socket from which only what passes the gate can be read."""

    def __init__(self, gate: Gate, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._gate = gate
        self._bucket = Bucket(RATE, BURST)
        self._pace = Every(1.0)
        self._untold = 0

    async def recv(self, decode: bool | None = None) -> Any:
        while True:
            try:
                raw = await super().recv(decode)
            except ConnectionClosed as closed:
                if closed.sent is not None and closed.sent.code == CloseCode.MESSAGE_TOO_BIG:
                    self._tell(f"a message of more than {LARGEST // 1024} kB; closed")
                raise
            if not self._bucket.take(self._gate.clock.now()):
                await self._end(f"more than {RATE:g} messages a second; closed")
            try:
                why = self._gate.passes(self._gate.page(self), raw)
            except MalformedError as e:
                await self._end(f"{e}; closed")
            if not why:
                return raw
            self._tell(why)

    async def _end(self, why: str) -> NoReturn:
        """Close, and raise what a read of a closed connection does; what still waits is lost."""
        self._tell(why)
        await self.close(CloseCode.POLICY_VIOLATION, _plain(why)[:100])
        raise self.protocol.close_exc

    def _tell(self, why: str) -> None:
        """Log a refusal, once a second for each connection: a flood shall not fill a disk."""
        self._gate.refused += 1
        self._untold += 1
        if self._pace.due(self._gate.clock.now()) or why.endswith("; closed"):
            page, address = self._gate.page(self), self.remote_address
            more = f" ({self._untold - 1} more refused before)" if self._untold > 1 else ""
            name = words(page) if page >= 0 else "a stranger"
            log.warning("%s at %s: refused %s%s", name, (address or ["?"])[0], _plain(why), more)
            self._untold = 0


def _plain(text: str) -> str:
    """What a stranger sent may be part of it: nothing that a terminal would obey, nor too long."""
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text[:200])
