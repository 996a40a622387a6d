"""Trying the own door: is it really there, on this port, and does the gate really judge?

viser is made to use our sockets from outside; should a version of it not do so, a page would
come up that anybody may use. So before a server is given away, it is called as a stranger
and as a page would call it, over the network.
"""

import socket
import time
from typing import Any, NoReturn

import msgspec
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.frames import CloseCode
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from app.errors import ServerError
from app.ui.door import PROTOCOL, Door, bracketed
from app.ui.inside import check_client

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.5, -2.0, 1.0], "fov": 0.8,
    "near": 0.1, "far": 100, "image_height": 720, "image_width": 1280, "look_at": [0, 0, 0.5],
    "up_direction": [0, 0, 1],
}  # fmt: skip
PATIENCE = 10.0  # [s] for each answer; a busy machine takes some of them


def try_door(server: viser.ViserServer, door: Door, reached: str) -> None:
    """Raises `ServerError` if a stranger gets in at `reached` (a host), or a page not to the gate.

    The page of this trial has number 0.
    """
    log = door.gate.log
    log.muted = True
    try:
        _as_stranger(door, reached)
        _as_page(server, door, reached)
    except (OSError, WebSocketException) as e:
        _refuse(f"it cannot be reached at {reached}:{door.port} ({type(e).__name__}: {e})")
    finally:
        log.muted = False
        door.gate.refused = 0


def _as_stranger(door: Door, reached: str) -> None:
    made = door.made
    try:
        _call(door, reached, "https://stranger.invalid").close()
    except InvalidStatus as e:
        if e.response.status_code != 403:
            _refuse(f"a foreign Origin was answered {e.response.status_code} instead of 403")
        if door.made != made + 1:
            _refuse("a foreign Origin was answered 403 by sockets that are not ours")
        return
    _refuse("a foreign Origin was let in")


def _as_page(server: viser.ViserServer, door: Door, reached: str) -> None:
    """Introduced as a page, nothing but nonsense is said: the gate has to end that."""
    with _call(door, reached, f"http://{bracketed(reached)}:{door.port}") as page:
        page.send(msgspec.msgpack.encode(CAMERA))
        _until(server.get_clients, "a page is not known to viser")
        (client,) = server.get_clients().values()
        check_client(client)
        ours = [s for s in door.places.inside if door.gate.page(s) == client.client_id]
        if not ours or not ours[0].counted:
            _refuse("what a page sends is not counted by its socket")
        page.send("knock, knock")
        end = _end(page)
        if end != CloseCode.POLICY_VIOLATION:
            _refuse(f"nonsense was answered {end} instead of {CloseCode.POLICY_VIOLATION:d}")
    _until(lambda: not server.get_clients() and not door.places.inside, "a page cannot be closed")


def _end(page: Connection) -> int | None:
    """Read to the end of the connection; the code that it was closed with."""
    try:
        while True:
            page.recv(timeout=PATIENCE)
    except ConnectionClosed as e:
        return e.rcvd.code if e.rcvd is not None else None
    except TimeoutError:
        return None


def _call(door: Door, reached: str, origin: str) -> ClientConnection:
    way: Any = {"origin": origin, "subprotocols": [PROTOCOL]}
    wire = socket.create_connection((reached, door.port), timeout=PATIENCE)
    return connect(
        f"ws://{bracketed(reached)}/", sock=wire, max_size=None, open_timeout=PATIENCE,
        close_timeout=1.0, **way,
    )  # fmt: skip


def _until(done: Any, otherwise: str) -> None:
    for _ in range(round(PATIENCE / 0.005)):
        if done():
            return
        time.sleep(0.005)
    _refuse(otherwise)


def _refuse(why: str) -> NoReturn:
    raise ServerError(
        f"the page's door is not in place: {why}; install the versions of viser and websockets "
        "that Flinch was made for (constraints.txt)"
    )
