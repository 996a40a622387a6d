"""The door: which sockets get in, how many, and how often.

    listener ─► waits ─► known Origin? ─► viser's subprotocol? ─► not too often? ─► a place ─► gate

A web socket is not held back by the browser's same-origin rule: any page that a person visits
may open one to a local port, and here that would mean moving an arm. So a socket whose Origin
is not this very page is refused before anything else.

Every browser is given a cookie. It opens nothing; but a browser whose page has operated is
known by it afterwards, and then needs no luck to get a place among a crowd of strangers.
"""

import asyncio
import functools
import secrets
import socket
from collections.abc import Callable, Iterable
from http import HTTPStatus
from typing import Any

import viser
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from app.ui.connection import LARGEST, GatedConnection
from app.ui.gate import Gate
from app.ui.listener import Listener, PausedError
from app.ui.own_page import dress
from app.ui.paced_log import library_logger
from app.ui.pacing import Bucket, Shares
from app.ui.places import Places, Rank

MOST_PAGES = 16  # open at once: each costs the processor that moves the arm some per cent
MOST_WAITING = 48  # sockets that have not (yet) become a page
FILES, FILES_BURST = 5.0, 40.0  # [1/s] of one neighbourhood; the page is one file of a megabyte
OPENINGS, OPENINGS_BURST = 0.5, 8.0  # [1/s] pages of one neighbourhood, or of one known browser
ALL_OPENINGS, ALL_BURST = 2.0, 16.0  # [1/s] pages of strangers: each is sent the whole scene
PROTOCOL = f"viser-v{viser.__version__}"
HEADERS = {
    # in a frame of somebody else's page a person could be led to press a button unseen
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}

Handler = Callable[[ServerConnection], Any]
Guard = Callable[[ServerConnection, Request], Response | None]


class Door:
    """Lets sockets in to one server. All but `__init__` runs on the thread of the sockets."""

    def __init__(self, host: str, listener: Listener, origins: Iterable[str], gate: Gate) -> None:
        self.gate, self.listener = gate, listener
        self.opened = 0  # how often viser has asked for sockets
        self.made = 0  # sockets that came through here
        self.port: int = listener.getsockname()[1]
        self.places: Places[GatedConnection] = Places(MOST_WAITING, MOST_PAGES)
        self._host, self._origins = host, frozenset(origins)
        self._files = Shares(FILES, FILES_BURST)
        self._openings = Shares(OPENINGS, OPENINGS_BURST)
        self._all_openings = Bucket(ALL_OPENINGS, ALL_BURST)

    def serve(self, real_serve: Any, handler: Handler, options: dict[str, Any]) -> Any:
        """websockets' server on our listener, with our guards around what viser wants of it."""
        self.opened += 1
        asyncio.get_running_loop().set_exception_handler(self._misfortune)
        options |= {
            "process_request": functools.partial(self._asked, options["process_request"]),
            "create_connection": functools.partial(GatedConnection, self),
            "logger": library_logger("websockets", self.gate.log),
            "max_size": LARGEST,
            "close_timeout": 2.0,  # a page that is sent away need not agree
        }
        return real_serve(functools.partial(self._welcome, handler), sock=self.listener, **options)

    def arrived(self, connection: GatedConnection) -> None:
        """There is a new socket."""
        self.made += 1
        goes = self.places.arrive(connection)
        if goes is not None:
            self.gate.log.tell("waiting", f"more than {MOST_WAITING} sockets waited; closed one")
            goes.transport.abort()

    def left(self, connection: GatedConnection) -> None:
        """A socket is closed."""
        self.places.leave(connection)

    async def _welcome(self, handler: Handler, connection: GatedConnection) -> None:
        if connection.subprotocol != PROTOCOL:  # a page of before an update: it tells its person
            why = f"this page is of {connection.subprotocol}, the server of {PROTOCOL}: reload it"
            connection.cut("version", why, CloseCode.PROTOCOL_ERROR)
            return
        await handler(connection)

    def _asked(self, serve_file: Guard, comer: GatedConnection, request: Request) -> Any:
        """Answer a request: a refusal, a file, or None to make it a page's socket."""
        headers = request.headers
        upgrade = "Upgrade" in headers
        origins = headers.get_all("Origin")
        known = self._known_origins(comer)
        if any(o not in known for o in origins) or (upgrade and not origins):
            told = f"refused a page from {', '.join(origins)[:100]!r}: no known origin"
            return self._refuse(comer, HTTPStatus.FORBIDDEN, "origin", told,
                                "this page may only be used from its own address")  # fmt: skip
        comer.visitor = self._cookie(headers)
        forwarded = ",".join(headers.get_all("X-Forwarded-For")).rpartition(",")[2].strip()
        if forwarded and self._origins and comer.local_address[0] == comer.address:
            comer.comes_from(forwarded)  # our proxy, on this machine, says for whom it asks
        return self._page(comer, headers) if upgrade else self._file(serve_file, comer, request)

    def _page(self, comer: GatedConnection, headers: Headers) -> Response | None:
        if "viser-v" not in ", ".join(headers.get_all("Sec-WebSocket-Protocol")):
            told = f"refused a socket of {comer.address} that does not speak as a page does"
            return self._refuse(comer, HTTPStatus.BAD_REQUEST, "protocol", told,
                                "this is no address for anything but its own page")  # fmt: skip
        now = self.gate.clock.now()
        trusted = comer.rank > Rank.STRANGER
        often = not self._openings.take(comer.visitor if trusted else comer.neighbourhood, now)
        if often or not (trusted or self._all_openings.take(now)):
            told = f"refused a page of {comer.address}: too many were opened"
            return self._refuse(comer, HTTPStatus.TOO_MANY_REQUESTS, "often", told,
                                "too many pages were opened; wait a moment")  # fmt: skip
        inside, goes = self.places.enter(comer)
        if not inside:
            told = f"refused a page of {comer.address}: {MOST_PAGES} are open"
            return self._refuse(comer, HTTPStatus.SERVICE_UNAVAILABLE, "full", told,
                                f"{MOST_PAGES} pages are open; close one")  # fmt: skip
        if goes is not None:
            why = f"its place to another: {MOST_PAGES} pages are open, and it was first"
            goes.cut("crowd", why, CloseCode.TRY_AGAIN_LATER)
        return None

    def _file(self, serve_file: Guard, comer: GatedConnection, request: Request) -> Any:
        if not self._files.take(comer.neighbourhood, self.gate.clock.now()):
            told = f"refused a file to {comer.address}: too many were asked for"
            return self._refuse(comer, HTTPStatus.TOO_MANY_REQUESTS, "files", told,
                                "too many files were asked for; wait a moment")  # fmt: skip
        response = serve_file(comer, request)
        if response is not None:
            dress(response)
            for name, value in HEADERS.items():
                response.headers[name] = value
            if not comer.visitor:
                cookie = f"{self._cookie_name}={secrets.token_urlsafe(16)}"
                response.headers["Set-Cookie"] = f"{cookie}; Path=/; HttpOnly; SameSite=Lax"
        return response

    def _refuse(
        self, comer: GatedConnection, status: HTTPStatus, kind: str, told: str, answer: str
    ) -> Response:
        self.gate.refused += 1
        self.gate.log.tell(kind, told)
        return comer.respond(status, f"{answer}\n")

    def _known_origins(self, connection: GatedConnection) -> set[str]:
        reached, port = connection.local_address[:2]
        names = {"127.0.0.1", "localhost", "[::1]", socket.gethostname().lower()}
        names |= {bracketed(self._host), bracketed(reached)}
        known = self._origins | {f"http://{name}:{port}" for name in names}
        if port == 80:  # browsers leave the default port out
            known |= {f"http://{name}" for name in names}
        return set(known)

    @property
    def _cookie_name(self) -> str:
        return f"flinch-{self.port}"  # a browser keeps one jar for all ports of a machine

    def _cookie(self, headers: Headers) -> str:
        """The browser's name, as it was given to it; empty if it has none."""
        pairs = ";".join(headers.get_all("Cookie")).split(";")
        values = (value for key, _, value in (p.strip().partition("=") for p in pairs)
                  if key == self._cookie_name)  # fmt: skip
        return next(values, "")[:64]

    def _misfortune(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """What asyncio would have written: strangers can cause some of it."""
        error = context.get("exception")
        if not isinstance(error, PausedError):  # the listener has told why
            self.gate.log.tell("loop", context.get("message", "asyncio"), error)


def bracketed(host: str) -> str:
    """A host as it is written in an address."""
    return f"[{host}]" if ":" in host else host
