"""The live views: one loopback port, read only, closed to web pages that were not named.

    listener ─► known Origin? ─► one of two subprotocols? ─► few enough? ─► a viewer

Any page that a person visits may open a socket to a local port, and this one tells where the arm
is and who stands before it. So a socket with an Origin is refused unless it was named. Programs
send none; `file://` is that of desktop viewers, and no web page can bear it.
"""

import asyncio
import logging
import threading
from collections.abc import Iterable
from http import HTTPStatus
from secrets import token_hex

from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request, Response

from app.errors import ServerError
from app.messages import Snapshot
from app.record.views.schemas import schemas_of
from app.record.views.views import Views
from app.timing import Clock, WallClock, date_now
from app.ui.engine import Engine
from app.ui.listener import Listener, bound
from app.ui.live.protocol import SUBPROTOCOLS, advertise, server_info
from app.ui.live.viewer import Viewer
from app.ui.live.window import DESKTOP, VIEWERS_PORT
from app.ui.paced_log import PacedLog, library_logger

log = logging.getLogger(__name__)
HOST = "127.0.0.1"  # never another one: nobody is asked who they are
PERIOD = 1.0 / 20.0  # [s] between two pictures
MOST = 4  # viewers at once: each costs the processor that moves the arm some per cent
LARGEST = 1 << 16  # [bytes] of a viewer's message
START = 10.0  # [s] for the thread to come up, or to end


class LiveViews:
    """Serves from `start` to `stop`; raises `ServerError` at once when the port is taken."""

    def __init__(
        self,
        engine: Engine,
        port: int = VIEWERS_PORT,
        origins: Iterable[str] = (),
        clock: Clock | None = None,
    ) -> None:
        """origins: of web pages that may look, as `https://app.foxglove.dev`."""
        self._clock = clock or WallClock()
        self._log = PacedLog(log)
        self._engine, self._origins = engine, frozenset((DESKTOP, *origins))
        self._views = Views(engine.robot, engine.skin, engine.cell)
        schemas = schemas_of(engine.robot)
        self._channels = {topic: number for number, topic in enumerate(schemas, 1)}
        self._hello = (
            server_info(f"Flinch: {engine.robot.title}", token_hex(8)),
            advertise(self._channels, schemas),
        )
        self._newest: dict[str, tuple[int, bytes]] = {}
        self._viewers: set[Viewer] = set()
        self._shown: Snapshot | None = None
        self._listener = Listener(bound(HOST, port), self._clock, self._log)
        self.port: int = self._listener.getsockname()[1]
        self._quit, self._up = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="live views", daemon=True)

    @property
    def url(self) -> str:
        """What a person gives to a viewer."""
        return f"ws://{HOST}:{self.port}"

    def start(self) -> None:
        """Let viewers in."""
        self._thread.start()
        if not self._up.wait(START):
            raise ServerError("the live views have not come up; start again without --foxglove")

    def stop(self) -> None:
        """Send everybody away; may be called twice, and without a start."""
        self._quit.set()
        if self._thread.is_alive():
            self._thread.join(START)
        self._listener.close()

    def step(self) -> None:
        """Show the newest snapshot to all viewers, on the loop's thread; free while there are
        none."""
        snapshot, _ = self._engine.snapshots.get()
        if snapshot is None or snapshot is self._shown or not self._viewers:
            return
        self._shown = snapshot
        at_ns = round(date_now() * 1e9)
        for topic, message in self._views.of(snapshot, at_ns):
            data = message.SerializeToString()
            self._newest[topic] = at_ns, data
            for viewer in self._viewers:
                viewer.put(topic, at_ns, data)

    # --- the thread of the sockets ------------------------------------------------------------

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception:  # whoever only looks stops no arm
            log.exception("the live views have failed; viewers see nothing any more")

    async def _serve(self) -> None:
        server = serve(
            self._welcome, sock=self._listener, process_request=self._asked,
            subprotocols=SUBPROTOCOLS, compression=None, max_size=LARGEST, max_queue=16,
            close_timeout=1.0, open_timeout=5.0, server_header=None,
            logger=library_logger("websockets", self._log),
        )  # fmt: skip
        async with server:
            self._up.set()
            while not self._quit.is_set():
                self.step()
                await asyncio.sleep(PERIOD)

    async def _welcome(self, socket: ServerConnection) -> None:
        viewer = Viewer(socket, self._channels, self._clock, self._log)
        self._viewers.add(viewer)
        try:
            for text in self._hello:
                await socket.send(text)
            await viewer.serve(self._newest)
        finally:
            self._viewers.discard(viewer)

    def _asked(self, socket: ServerConnection, request: Request) -> Response | None:
        """A refusal, or None to let a viewer in."""
        strange = [o for o in request.headers.get_all("Origin") if o not in self._origins]
        offered = ", ".join(request.headers.get_all("Sec-WebSocket-Protocol"))
        if strange:
            words = f"refused a viewer from {strange[0][:100]!r}"
            self._log.tell("origin", f"{words}; --foxglove-origin {strange[0][:100]} lets it in")
            return socket.respond(HTTPStatus.FORBIDDEN, "this page may not look\n")
        if not any(name in offered for name in SUBPROTOCOLS):
            told = f"for viewers of {' or '.join(SUBPROTOCOLS)} only\n"
            return socket.respond(HTTPStatus.BAD_REQUEST, told)
        if len(self._viewers) >= MOST:
            self._log.tell("full", f"refused a viewer: {MOST} look already; close one")
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST} viewers look already\n")
        return None
