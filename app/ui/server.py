"""Who may connect: a viser server that only its own page can talk to.

A web socket is not held back by the browser's same-origin rule: any page that a person
visits may open one to a local port, and here that would mean moving an arm. viser checks
neither the Origin nor the port it is given, so both are done here, on the socket that it
is handed. What a connected page may send is judged by the gate (`app.ui.gate`).
"""

import errno
import functools
import logging
import socket
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import rich
import viser
import websockets.asyncio.server as ws_server
from viser import _messages
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from app.errors import ServerError
from app.timing import WallClock
from app.ui.access import Access
from app.ui.gate import LARGEST, Gate, GatedConnection
from app.ui.pacing import Every

log = logging.getLogger(__name__)
MOST_PAGES = 16  # open at once: each costs the processor that moves the arm some per cent
HEADERS = {
    # in a frame of somebody else's page a person could be led to press a button unseen
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}
_patching = threading.Lock()


def open_page(
    host: str = "127.0.0.1",
    port: int = 8080,
    title: str = "Flinch",
    gate: Gate | None = None,
    origins: Iterable[str] = (),
) -> viser.ViserServer:
    """A server on exactly this port (0 = any free one); the caller stops it in a `finally`.

    No page can use anything before `gate` is opened; without one, never. `origins` are further
    addresses of the page, as of a proxy: `https://cell.example`.

    Raises `ServerError` when the port is taken or the address is not this machine's.
    """
    listener = _listen(host, port)
    real_serve = ws_server.serve
    gate = gate or Gate(Access(), WallClock())

    def guarded_serve(handler: Any, _host: str, _port: int, **options: Any) -> Any:
        options |= {
            "process_request": _guard(host, frozenset(origins), gate, options["process_request"]),
            "create_connection": functools.partial(GatedConnection, gate),
            "max_size": LARGEST,
            "close_timeout": 2.0,  # a page that is sent away need not agree
        }
        return real_serve(handler, sock=listener, **options)

    # viser has no option for a ready socket or for origins, so its one call to websockets is
    # wrapped while the server starts; `_patching` keeps two starting servers apart.
    # It also prints a banner of its own; the program says the address itself.
    with _patching:
        ws_server.serve = guarded_serve  # type: ignore[misc, assignment]
        rich.get_console().quiet = True
        try:
            server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
        except BaseException:
            listener.close()
            raise
        finally:
            ws_server.serve = real_serve  # type: ignore[misc]
            rich.get_console().quiet = False

    # anyone connected could ask for a public tunnel to this arm, button or not
    server._websock_server.unregister_handler(_messages.ShareUrlRequest)
    server.gui.configure_theme(
        show_share_button=False,
        show_logo=False,
        control_width="medium",
        brand_color=(32, 100, 170),
    )
    return server


@contextmanager
def serving(host: str = "127.0.0.1", port: int = 8080) -> Iterator[viser.ViserServer]:
    """`open_page` that stops the server on the way out, whatever happened."""
    server = open_page(host, port)
    try:
        yield server
    finally:
        server.stop()


def page_url(server: viser.ViserServer) -> str:
    """The address to open in a browser."""
    host = server.get_host()
    shown = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, _bracketed(host))
    return f"http://{shown}:{server.get_port()}"


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as e:
        if e.errno == errno.EADDRINUSE:
            raise ServerError(
                f"port {port} on {host} is taken; stop the other program or give another port "
                "(0 = any free one)"
            ) from e
        raise ServerError(
            f"cannot listen on {host}:{port} ({e.strerror or e}); "
            "give an address of this machine, such as 127.0.0.1, and a port you may use"
        ) from e


def _guard(
    host: str, public: frozenset[str], gate: Gate, serve_file: Callable[..., Response | None]
) -> Callable[..., Response | None]:
    """Refuse strangers before anything else: 403 unless the Origin is this very server."""
    pace = Every(1.0)  # of the log: a stranger's page may try in a loop

    def process_request(connection: ServerConnection, request: Request) -> Response | None:
        reached, port = connection.local_address[:2]
        names = {"127.0.0.1", "localhost", "[::1]", socket.gethostname().lower()}
        names |= {_bracketed(host), _bracketed(reached)}
        known = public | {f"http://{name}:{port}" for name in names}
        if port == 80:  # browsers leave the default port out
            known |= {f"http://{name}" for name in names}
        origins = request.headers.get_all("Origin")
        upgrade = "Upgrade" in request.headers
        if any(o not in known for o in origins) or (upgrade and not origins):
            if pace.due(gate.clock.now()):
                log.warning("refused a page from %r: no known origin", ", ".join(origins)[:100])
            return connection.respond(
                HTTPStatus.FORBIDDEN, "this page may only be used from its own address\n"
            )
        if upgrade and len(connection.server.connections) >= MOST_PAGES:
            if pace.due(gate.clock.now()):
                log.warning("refused a page: %d are open", MOST_PAGES)
            return connection.respond(
                HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_PAGES} pages are open; close one\n"
            )
        response = serve_file(connection, request)
        if response is not None:
            for name, value in HEADERS.items():
                response.headers[name] = value
        return response

    return process_request
