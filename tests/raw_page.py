"""A page without a browser: a web socket that says to viser's server whatever it is told to."""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import Any, TypeVar

import msgspec
import pytest
import viser
import zstandard
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from app.ui.server import page_url

T = TypeVar("T")
CAMERA = {
    "kind": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, -2.0, 1], "fov": 0.7,
    "near": 0.1, "far": 100, "image_height": 720, "image_width": 1280, "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1],
}  # fmt: skip


def play(scene: Coroutine[Any, Any, T]) -> T:
    """Run a test's coroutine, at most half a minute."""
    return asyncio.run(asyncio.wait_for(scene, 30.0))


class RawPage:
    """One connection; all that it is sent is kept, unpacked."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.number = -1  # by which the server knows it
        self.heard: list[dict[str, Any]] = []
        self.bytes = b""  # all that came, text unpacked
        self._reader = asyncio.create_task(self._read())

    async def _read(self) -> None:
        unpack = zstandard.ZstdDecompressor()
        with suppress(ConnectionClosed):
            async for raw in self.socket:
                assert isinstance(raw, bytes)
                size, packed = (int.from_bytes(raw[i : i + 8], "little") for i in (0, 8))
                inner = unpack.decompress(raw[16 : 16 + packed], max_output_size=size)
                self.bytes += inner + raw[16 + packed :]
                self.heard += msgspec.msgpack.decode(inner)["messages"]

    async def say(self, kind: str, **fields: Any) -> None:
        """Send a message as a page would."""
        await self.raw(msgspec.msgpack.encode({"type": kind, **fields}))

    async def raw(self, data: bytes | str) -> None:
        """Send anything; a closed connection is no error."""
        with suppress(ConnectionClosed):
            await self.socket.send(data)

    async def press(self, handle: Any, value: Any = True) -> None:
        """Use a control or a command."""
        uuid = handle._impl.uuid
        if isinstance(handle, viser.CommandHandle):
            await self.say("CommandTriggerMessage", uuid=uuid)
        else:
            await self.say("GuiUpdateMessage", uuid=uuid, updates={"value": value})

    def told(self, uuid: str, name: str) -> list[Any]:
        """Every value of a control's property that came, as updates."""
        updates = [m["updates"] for m in self.heard if m["type"] == "GuiUpdateMessage"
                   and m["uuid"] == uuid]  # fmt: skip
        return [u[name] for u in updates if name in u]

    async def closed(self) -> int:
        """Wait for the end of the connection; its code."""
        await self._reader
        return self.socket.close_code or 0


@asynccontextmanager
async def raw_page(
    server: viser.ViserServer, origin: str = "", headers: dict[str, str] | None = None, **way: Any
) -> AsyncIterator[RawPage]:
    """An open page that the server knows: it has told where its camera is."""
    url = page_url(server)
    async with connect(
        url.replace("http", "ws"),
        origin=origin or url,  # type: ignore[arg-type]
        additional_headers=headers,
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        proxy=None,
        max_size=None,
        close_timeout=1.0,
        **way,
    ) as socket:
        page = RawPage(socket)
        before = set(server.get_clients())
        await page.say(**CAMERA)
        await until(lambda: set(server.get_clients()) - before)
        page.number = max(server.get_clients())
        yield page
    await until(lambda: page.number not in server.get_clients())


def told(log: pytest.LogCaptureFixture) -> list[str]:
    """What the server has logged, not what the tests' own clients have."""
    return [r.getMessage() for r in log.records if r.name != "websockets.client"]


async def until(done: Any, seconds: float = 5.0) -> None:
    """Wait until `done()`; fails after `seconds`."""
    for _ in range(round(seconds / 0.01)):
        if done():
            return
        await asyncio.sleep(0.01)
    raise AssertionError(f"not within {seconds:g} s")
