"""What is used of viser's inside: all of it is here, and looked for before a page can come.

viser is pinned to a minor version, but a private name may go with any patch; then the start
is refused, instead of a callback failing when a person presses something.
"""

from collections.abc import Iterable
from operator import attrgetter
from typing import Any

import viser
from viser import _messages as m

from app.errors import ServerError

VERSION = "1.1."  # what pyproject pins
PARTS = (
    "_websock_server.unregister_handler", "_websock_server._live_connections",
    "_websock_server._broadcast_buffer.message_counter",
    "_websock_server._broadcast_buffer.generator_cursors",
    "_websock_server._broadcast_buffer.buffer_lock",
    "_websock_server._broadcast_buffer.message_from_id",
    "gui._gui_input_handle_from_uuid", "gui._command_handle_from_uuid",
    "scene._handle_from_transform_controls_name",
)  # fmt: skip


class Inside:
    """One server's private parts, by what they are used for."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Raises `ServerError` where viser is not the one that this was written for."""
        for part in PARTS:
            if not _has(server, part):
                raise _other_viser(f"it has no {part}")
        self._server = server
        self._sockets: dict[int, Any] = server._websock_server._live_connections
        self._news = server._websock_server._broadcast_buffer

    def forbid_tunnels(self) -> None:
        """No page may ask for a public tunnel to this server, which any page could."""
        for message in (m.ShareUrlRequest, m.ShareUrlDisconnect):
            self._server._websock_server.unregister_handler(message)

    def page(self, socket: Any) -> int:
        """The number of the page on a socket, -1 if viser does not know it (yet)."""
        return next((page for page, known in self._sockets.items() if known is socket), -1)

    def socket(self, page: int) -> Any:
        """The socket of a page, None if it is gone."""
        return self._sockets.get(page)

    def handle(self, page: int, uuid: str) -> Any:
        """The control or command `uuid` as the page has it, None if it has none."""
        client = self._server.get_clients().get(page)
        for gui in (self._server.gui, client.gui if client is not None else None):
            if gui is not None:
                found: Any = gui._gui_input_handle_from_uuid.get(uuid)
                found = found or gui._command_handle_from_uuid.get(uuid)
                if found is not None:
                    return found
        return None

    def shared(self) -> dict[str, bool]:
        """Whether each of the controls that all pages have is disabled, by its uuid."""
        known: dict[str, Any] = self._server.gui._gui_input_handle_from_uuid
        return {uuid: handle.disabled for uuid, handle in list(known.items())}

    def gizmos(self) -> list[tuple[str, Any]]:
        """The handles to drag that all pages have, by name."""
        return list(self._server.scene._handle_from_transform_controls_name.items())

    def said(self) -> int:
        """Number of the last message to all pages; they count from 0."""
        return self._news.message_counter - 1

    def heard(self, page: int) -> int | None:
        """Number of the last message to all that was sent to the page; None if it is gone."""
        return self._news.generator_cursors.get(page)

    def kept(self, numbers: Iterable[int]) -> list[Any]:
        """Those of the messages to all that have not been replaced by a newer one."""
        with self._news.buffer_lock:
            return [x for n in numbers if (x := self._news.message_from_id.get(n)) is not None]


def check_version() -> None:
    """Raises `ServerError` for a viser that nobody has looked into."""
    if not viser.__version__.startswith(VERSION):
        raise _other_viser(f"only {VERSION}* is known here")


def check_client(client: viser.ClientHandle) -> None:
    """Raises `ServerError` where a page's own private parts are not what they were."""
    if not _has(client, "_websock_connection.queue_message"):
        raise _other_viser("a client's handle has no _websock_connection.queue_message")


def send(client: viser.ClientHandle, message: m.Message) -> None:
    """Send a message to one page alone."""
    client._websock_connection.queue_message(message)


def uuid_of(handle: Any) -> str:
    """The name by which pages call a control or a command."""
    return str(handle._impl.uuid)


def _has(thing: Any, part: str) -> bool:
    try:
        attrgetter(part)(thing)
    except AttributeError:
        return False
    return True


def _other_viser(why: str) -> ServerError:
    return ServerError(
        f"viser {viser.__version__} cannot be guarded ({why}); install the one that Flinch was "
        f'made for: pip install "viser=={VERSION}*"'
    )
