"""The virtual controller on the network: three ports, one thread, one 500 Hz cycle.

The ports are the real ones, since clients know no others; several virtual controllers live
side by side on addresses of their own (127.0.0.2, 127.0.0.3, ...).
"""

import asyncio
import logging
import random
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from app.errors import ServerError
from app.robot.ur.wire import Kind, WireError, split
from app.timing import WallClock
from app.virtual.ur.controller import PERIOD, UrController
from app.virtual.ur.dashboard import GREETING, answer
from app.virtual.ur.rtde import RtdeClient

log = logging.getLogger(__name__)
T = TypeVar("T")
DASHBOARD, SCRIPT, RTDE = 29999, 30003, 30004
POLYSCOPE_X = 10  # major version of the first without a dashboard
LONGEST_SCRIPT = 1_000_000  # bytes
BEHIND = 5.0  # [s] a stall of the machine that is longer is not made up for
LISTEN = 3  # turns of the loop until bytes that wait have become registers
BACKLOG = 64_000  # bytes that a client may be late with before it is left out

_Talk = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Coroutine[Any, Any, None]]
_Writers = dict[asyncio.StreamWriter, RtdeClient | None]


class UrServer:
    """Serves a controller in a thread of its own, from `start` to `stop`."""

    def __init__(self, controller: UrController, host: str = "127.0.0.1") -> None:
        self.controller, self.host = controller, host
        self._writers: _Writers = {}
        self._owners: dict[str, RtdeClient] = {}
        self._held: list[tuple[asyncio.StreamWriter, bytes]] = []  # states that a stall holds up
        self._noise = random.Random(0)
        self._cut = ""  # what was done to the link in the last cycle
        self._loop = asyncio.new_event_loop()
        self._quit = asyncio.Event()
        self._ready = threading.Event()
        self._refused = ""
        self._thread = threading.Thread(target=self._run, name="ur-emulator", daemon=True)

    def start(self) -> None:
        """Open the ports; a ServerError names one that is taken."""
        self._thread.start()
        self._ready.wait()
        if self._refused:
            self._thread.join()
            raise ServerError(self._refused)

    def stop(self) -> None:
        """Close everything; returns when the thread has ended."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._quit.set)
            self._thread.join()

    def ask(self, question: Callable[[UrController], T]) -> T:
        """What `question` answers between two cycles; for another thread."""

        async def between() -> T:
            return question(self.controller)

        return asyncio.run_coroutine_threadsafe(between(), self._loop).result(timeout=5.0)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()
            self._ready.set()

    async def _serve(self) -> None:
        servers = []
        try:
            ports = [(DASHBOARD, self._dashboard), (SCRIPT, self._script), (RTDE, self._rtde)]
            for port, talk in ports[self.controller.version[0] >= POLYSCOPE_X :]:
                servers.append(await asyncio.start_server(self._guard(talk), self.host, port))
        except OSError as e:
            self._refused = (
                f"{self.host}:{port} cannot be opened ({e.strerror}); end what holds it, "
                "or give another address with --host, as 127.0.0.2"
            )
        else:
            self._ready.set()
            await self._cycle()
        for server in servers:
            server.close()
        self._cut_all()
        await asyncio.sleep(0)

    async def _cycle(self) -> None:
        clock = WallClock()
        next_at = clock.now()
        while not self._quit.is_set():
            while next_at <= clock.now():
                for _ in range(LISTEN):  # what came during a stall came before this cycle
                    await asyncio.sleep(0)
                self.controller.step(PERIOD)
                next_at += PERIOD
                if clock.now() - next_at > BEHIND:
                    next_at = clock.now()
                self._send()
            await asyncio.sleep(max(0.0, next_at - clock.now()))

    def _send(self) -> None:
        cut, before = self.controller.cut, self._cut
        self._cut = cut
        if cut == "drop" or (cut == "silent" and before != "silent"):
            self._cut_all()
        if cut in ("drop", "mute", "silent"):
            return
        for writer, client in self._writers.items():
            data = client.data() if client is not None else b""
            if data:
                self._held.append((writer, self._garbled(data) if cut == "corrupt" else data))
        if cut != "stall":
            for writer, data in self._held:
                if writer in self._writers and writer.transport.get_write_buffer_size() < BACKLOG:
                    writer.write(data)
            self._held.clear()

    def _garbled(self, data: bytes) -> bytes:
        """As many bytes of noise, behind a size that no packet has."""
        return bytes(2) + self._noise.randbytes(len(data) - 2)

    async def _deaf(self) -> bool:
        """Is what came in lost? Waits as long as a stall holds it up."""
        while self.controller.cut == "stall":
            await asyncio.sleep(PERIOD)
        return self.controller.cut in ("drop", "mute")

    def _cut_all(self) -> None:
        for writer in list(self._writers):
            writer.transport.abort()

    def _guard(self, talk: _Talk) -> _Talk:
        async def guarded(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            if self.controller.cut == "drop":
                writer.transport.abort()
                return
            self._writers[writer] = None
            try:
                await talk(reader, writer)
            except (
                WireError,
                ValueError,
            ) as error:  # ValueError: a line longer than a reader holds
                log.warning("a client was sent away: %s", error)
            except (ConnectionError, asyncio.CancelledError):
                pass  # a client that leaves, or the end of the emulator
            finally:
                client = self._writers.pop(writer, None)
                if client is not None:
                    client.leave()
                writer.close()

        return guarded

    async def _dashboard(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(f"{GREETING}\n".encode())
        while line := await reader.readline():
            if await self._deaf():
                continue
            text = answer(self.controller, line.decode("utf-8", "replace"))
            writer.write(f"{text}\n".encode())
            if text == "Disconnected":
                return

    async def _script(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        lines: list[bytes] = []
        size = 0
        while line := await reader.readline():
            if await self._deaf():
                continue
            lines.append(line)
            size += len(line)
            if line.rstrip() == b"end":  # the last one, since it stands at the margin
                self.controller.upload(b"".join(lines).decode("utf-8", "replace"))
                lines, size = [], 0
            elif size > LONGEST_SCRIPT:
                raise WireError("a program without an end")

    async def _rtde(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        client = RtdeClient(self.controller, self._owners)
        self._writers[writer] = client
        rest = b""
        while data := await reader.read(65536):
            if await self._deaf():
                continue
            packets, rest = split(rest + data)
            for packet in packets:
                if self.controller.cut == "silent" and packet.kind != Kind.VERSION:
                    continue
                reply = client.take(packet)
                if reply:
                    writer.write(reply)
