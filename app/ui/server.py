"""A viser server that only its own page can talk to: started behind our door, or not at all.

viser checks neither who connects nor the port that it is given, and has no option for either.
So its one call to websockets is led to our door (`app.ui.door`) while it starts, and the door
is tried before the server is given away: what does not answer as it should is stopped.
"""

import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import rich
import viser
import websockets.asyncio.server as ws_server

from app.errors import ServerError
from app.timing import WallClock
from app.ui.access import Access
from app.ui.door import Door, bracketed
from app.ui.gate import Gate
from app.ui.inside import check_version
from app.ui.knock import try_door
from app.ui.listener import Listener, bound

START = 20.0  # [s] for viser to come up
_patching = threading.Lock()


def open_page(
    host: str = "127.0.0.1",
    port: int = 8080,
    title: str = "Flinch",
    gate: Gate | None = None,
    origins: Iterable[str] = (),
) -> viser.ViserServer:
    """A server on exactly this port (0 = any free one); end it by `close_page` in a `finally`.

    No page can use anything before `gate` is opened; without one, never. `origins` are further
    addresses of the page, as of a proxy: `https://cell.example`.

    Raises `ServerError` when the port is taken, when the address is not this machine's, and when
    Origin check and gate are not really in place; nothing listens any more then.
    """
    check_version()
    gate = gate or Gate(Access(), WallClock())
    listener = Listener(bound(host, port), gate.clock, gate.log)
    door = Door(host, listener, origins, gate)
    try:
        server = _behind(door, host, title)
        try:
            _check(server, door, host)
        except BaseException:
            close_page(server)
            raise
    except BaseException:
        listener.close()
        raise
    paint(server, dark=False)
    return server


def paint(page: viser.ViserServer | viser.ClientHandle, dark: bool) -> None:
    """Light or dark, all pages or one."""
    page.gui.configure_theme(
        show_share_button=False,
        show_logo=False,
        control_width="medium",
        brand_color=(32, 100, 170),
        dark_mode=dark,
    )


def close_page(server: viser.ViserServer) -> None:
    """Stop the server, without viser's word about it on the console."""
    with _quiet():
        server.stop()


def page_url(server: viser.ViserServer) -> str:
    """The address to open in a browser."""
    return f"http://{bracketed(_reached(server.get_host()))}:{server.get_port()}"


def _behind(door: Door, host: str, title: str) -> viser.ViserServer:
    """viser, which asks websockets for sockets and is given those of `door`."""
    real_serve = ws_server.serve
    outcome: queue.SimpleQueue[viser.ViserServer | BaseException] = queue.SimpleQueue()

    def guarded_serve(handler: Any, *_: Any, **options: Any) -> Any:
        try:
            if door.opened:
                raise ServerError(f"cannot listen on port {door.port}; give another port")
            return door.serve(real_serve, handler, options)
        except Exception as e:
            outcome.put(e)
            raise SystemExit from e  # ends viser's thread; viser would wait for it for ever

    def start() -> None:
        try:
            outcome.put(viser.ViserServer(host=host, port=door.port, label=title, verbose=False))
        except BaseException as e:
            outcome.put(e)

    # `_patching` keeps two starting servers apart.
    with _patching, _quiet():
        ws_server.serve = guarded_serve  # type: ignore[misc, assignment]
        try:
            threading.Thread(target=start, name="start viser", daemon=True).start()
            server = outcome.get(timeout=START)
        except queue.Empty:
            # `serve` stays ours: should viser still come, it shall not come up unguarded
            door.opened += 1
            raise ServerError(f"viser has not come up within {START:g} s; start again") from None
        ws_server.serve = real_serve  # type: ignore[misc]
    if isinstance(server, ServerError):
        raise server
    if isinstance(server, BaseException):
        raise ServerError(
            f"viser {viser.__version__} cannot be started behind the page's door "
            f"({type(server).__name__}: {server}); install the versions in constraints.txt"
        ) from server
    return server


def _check(server: viser.ViserServer, door: Door, host: str) -> None:
    """Raises `ServerError` unless this server is behind the door, with a gate that judges."""
    if not door.opened or server.get_port() != door.port:
        raise ServerError(
            f"viser {viser.__version__} listens on port {server.get_port()}, past the page's door "
            f"on port {door.port}; install the versions in constraints.txt"
        )
    door.gate.attach(server).forbid_tunnels()
    try_door(server, door, _reached(host))


def _reached(host: str) -> str:
    """The address at which this machine itself reaches a server on `host`."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)


@contextmanager
def _quiet() -> Iterator[None]:
    """viser prints a banner and its end; the program says the address itself."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
