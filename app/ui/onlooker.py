"""A page without a browser: connects, says where its camera is, reads all that comes.

    python -m app.ui.onlooker http://127.0.0.1:8080

Run as a process of its own beside a measurement, it loads the server as one browser does.
"""

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import viser
from websockets.asyncio.client import connect

from app.ui.engine import Engine
from app.ui.knock import CAMERA
from app.ui.page import Page

PATIENCE = 10.0  # [s] for the onlooker to be there


@contextmanager
def onlooked(engine: Engine) -> Iterator[None]:
    """A page for `engine` with one onlooker, for as long as the context lasts."""
    with Page(engine, "127.0.0.1", 0) as page:
        command = [sys.executable, "-m", "app.ui.onlooker", page.url]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                if process.stdout.readline().strip() != "connected":
                    raise RuntimeError("the onlooker did not connect")
                yield
            finally:
                process.terminate()


async def look(url: str) -> None:
    """Read until the server ends the connection."""
    async with connect(
        url.replace("http", "ws", 1),
        origin=url,  # type: ignore[arg-type]
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        proxy=None,
        max_size=None,
        open_timeout=PATIENCE,
    ) as socket:
        await socket.send(msgspec.msgpack.encode(CAMERA))
        await socket.recv()
        sys.stdout.write("connected\n")
        sys.stdout.flush()
        async for _ in socket:
            pass


if __name__ == "__main__":
    asyncio.run(look(sys.argv[1]))
