"""A page's socket: what comes is counted before it is parsed, and judged before viser reads it.

A frame of six bytes costs a processor as much as a message of a kilobyte, and websockets
answers pings by itself, so frames of any kind count. What arrives is parsed in slices: a
quarter of a megabyte of pings in one read would hold up every page for half a second.
"""

from typing import TYPE_CHECKING, Any, NoReturn

from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode
from websockets.protocol import SEND_EOF, State

from app.ui.access import words
from app.ui.listener import neighbourhood
from app.ui.paced_log import plain
from app.ui.pacing import Bucket
from app.ui.places import Rank
from app.ui.wire import MalformedError

if TYPE_CHECKING:
    from app.ui.door import Door

LARGEST = 64 * 1024  # [bytes] of one message; a page's own are below one kilobyte
RATE, BURST = 100.0, 200.0  # [1/s] frames of one page; a hand that drags sends at most 80
OWN, OWN_BURST = 20.0, 40.0  # [1/s] messages of a page that watches; beyond, see Gate.surplus
BYTES, BYTES_BURST = 256.0 * 1024, 1024.0 * 1024  # [bytes/s] of one page
HEAD = 16 * 1024  # [bytes] of a request; a browser's is below two kilobytes
SLICE = 1024  # [bytes] parsed at once
LINGER = 1.0  # [s] for a page that is sent away to read why
OVERLOOKED = 1024 * 1024  # [bytes] of such a page that are read no more
RUDE = {
    CloseCode.MESSAGE_TOO_BIG: f"a message of more than {LARGEST // 1024} kB; closed",
    CloseCode.PROTOCOL_ERROR: "bytes that are no frames; closed",
    CloseCode.INVALID_DATA: "text that is none; closed",
}


class GatedConnection(ServerConnection):
    """A socket from which only what passes the gate can be read."""

    def __init__(self, door: "Door", *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._door, self._gate = door, door.gate
        self._frames, self._bytes = Bucket(RATE, BURST), Bucket(BYTES, BYTES_BURST)
        self._own = Bucket(OWN, OWN_BURST)
        self._head = self._overlooked = 0
        self.counted = 0  # frames
        self._over = False  # nothing more is parsed
        self._cut = False  # nothing more is given to viser
        self.visitor = ""  # the browser, by its cookie; set by the door
        self.address = self.neighbourhood = "?"

    @property
    def rank(self) -> Rank:
        """Who has to go first when there are too many."""
        return self._gate.rank(self)

    def comes_from(self, address: str) -> None:
        """Who is at the other end; whose share it uses up."""
        self.address, self.neighbourhood = address[:64], neighbourhood(address[:64])

    # --- asyncio's callbacks ----------------------------------------------------------------

    def connection_made(self, transport: Any) -> None:
        self.comes_from((transport.get_extra_info("peername") or ["?"])[0])
        super().connection_made(transport)
        self._door.arrived(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._door.left(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        for first in range(0, len(data), SLICE):
            if self._over:
                self._overlooked += len(data) - first
                if self._overlooked > OVERLOOKED:
                    self.transport.abort()
                return
            self._take(data[first : first + SLICE])

    def _take(self, part: bytes) -> None:
        if self.request is None:
            self._head += len(part)
            if self._head > HEAD:
                self._tell("head", f"a request of more than {HEAD // 1024} kB; closed")
                self._over = True
                self.transport.abort()
                return
        elif not self._bytes.take(self._gate.clock.now(), len(part)):
            self.cut("bytes", f"more than {BYTES / 1024:g} kB a second")
            return
        super().data_received(part)
        if self.state in (State.CLOSING, State.CLOSED) and not self._over:
            sent = self.protocol.close_sent
            if sent is not None and sent.code in RUDE:
                self._tell(f"end {sent.code}", RUDE[CloseCode(sent.code)])
            self._end()

    def process_event(self, event: Any) -> None:
        """One parsed frame, or the request; the pong to a ping is on its way already."""
        if self._over:
            return
        if self.request is not None:
            self.counted += 1
            if not self._frames.take(self._gate.clock.now()):
                self.cut("frames", f"more than {RATE:g} frames a second")
                return
        super().process_event(event)

    # --- what viser reads -------------------------------------------------------------------

    async def recv(self, decode: bool | None = None) -> Any:
        while True:
            raw = await super().recv(decode)
            if self._cut:
                await self._closed()
            try:
                why = self._busy() or self._gate.passes(self._gate.page(self), raw)
            except MalformedError as e:
                self.cut("malformed", str(e))
                await self._closed()
            if not why:
                return raw
            self._tell("misuse", why)

    def _busy(self) -> str:
        """Why a message is not even looked at: a crowd that watches shall not use up the processor.

        Each page has its own share, so a Stop passes however much the others send.
        """
        now = self._gate.clock.now()
        if self._own.take(now) or self.rank is Rank.OPERATOR or self._gate.surplus.take(now):
            return ""
        return "more messages than all who watch may send together"

    def recv_streaming(self, decode: bool | None = None) -> Any:
        """Parts of messages cannot be judged, so there is no such way."""
        raise NotImplementedError("messages are read whole here: use recv")

    def send_data(self) -> None:
        """Write what waits at once; nothing to a socket that is gone: asyncio logs each try."""
        data = self.protocol.data_to_send()
        if self.transport.is_closing():
            return
        whole = b"".join(data)
        if whole:
            self.transport.write(whole)
        if SEND_EOF in data and not self.transport.is_closing():
            self.transport.write_eof()

    # --- the end ----------------------------------------------------------------------------

    def cut(self, kind: str, why: str, code: CloseCode = CloseCode.POLICY_VIOLATION) -> None:
        """End the connection; what still waits of it is lost. Does not wait for the other end."""
        if self._over:
            return
        self._cut = True
        self._tell(kind, f"{why}; closed")
        if self.state is State.OPEN:
            self.protocol.fail(code, plain(f"{why}; closed")[:100])
            self.send_data()
        self._end()

    def _end(self) -> None:
        """Nothing more is parsed, and the socket goes soon, whether or not the page wants to."""
        self._over = True
        self.loop.call_later(LINGER, self.transport.abort)

    async def _closed(self) -> NoReturn:
        """Raise what a read of a closed connection does."""
        await self.wait_closed()
        raise self.protocol.close_exc

    def _tell(self, kind: str, why: str) -> None:
        page = self._gate.page(self)
        name = words(page) if page >= 0 else "a stranger"
        self._gate.refused += 1
        self._gate.log.tell(kind, f"{name} at {self.address}: refused {why}")
