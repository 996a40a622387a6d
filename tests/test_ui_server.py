"""Who may connect: the page's server, its address and its Origin check."""

import asyncio
import socket

import pytest
import viser
from viser import _messages
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from app.errors import ServerError
from app.ui.page import Page
from app.ui.server import open_page, page_url, serving
from tests.ui_page import FakeEngine, the_built, the_engine, the_page  # noqa: F401 - fixtures


def knock(server: viser.ViserServer, origin: str | None, address: str = "") -> int:
    """Status with which the server answers a web socket from a page at `origin`."""

    async def call() -> int:
        url = (address or page_url(server)).replace("http", "ws")
        try:
            version = f"viser-v{viser.__version__}"
            async with connect(url, origin=origin, subprotocols=[version], proxy=None):  # type: ignore[arg-type, list-item]
                return 101
        except InvalidStatus as e:
            return e.response.status_code

    return asyncio.run(call())


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_the_own_page_gets_in(page: Page, name: str) -> None:
    assert knock(page.server, f"http://{name}:{page.server.get_port()}") == 101


def test_strangers_are_refused(page: Page) -> None:
    port = page.server.get_port()
    strangers = (
        "http://evil.example", f"http://evil.example:{port}", f"http://localhost:{port + 1}",
        f"https://localhost:{port}", f"http://localhost.evil.example:{port}", "null", None,
    )  # fmt: skip
    assert {origin: knock(page.server, origin) for origin in strangers} == dict.fromkeys(
        strangers, 403
    )


def test_it_listens_on_the_loopback_address_only(page: Page) -> None:
    """127.0.0.2 is this machine too, and would be answered by a server on 0.0.0.0."""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", page.server.get_port()), timeout=5.0)


def test_beyond_the_loopback_a_page_is_known_by_the_address_that_was_asked(
    engine: FakeEngine,
) -> None:
    page = Page(engine, host="0.0.0.0", port=0, token="x" * 16)  # 127.0.0.2 stands for a network
    try:
        port = page.server.get_port()
        near, far = f"http://127.0.0.2:{port}", f"http://192.0.2.7:{port}"
        assert knock(page.server, near, near) == 101
        assert knock(page.server, far, near) == 403
        assert knock(page.server, "https://cell.example", near) == 403
    finally:
        page.server.stop()


def test_a_public_origin_is_let_in_where_it_was_named(engine: FakeEngine) -> None:
    page = Page(engine, port=0, token="x" * 16, origins=("https://cell.example",))
    try:
        assert knock(page.server, "https://cell.example") == 101
        assert knock(page.server, "https://cell.example:8443") == 403
        assert knock(page.server, "http://cell.example") == 403
    finally:
        page.server.stop()


def test_a_taken_port_is_told_with_the_remedy(page: Page) -> None:
    port = page.server.get_port()
    with pytest.raises(ServerError, match=f"port {port} .* taken.* another port") as e:
        open_page(port=port)
    assert "\n" not in str(e.value)


def test_an_address_of_another_machine_is_told() -> None:
    with pytest.raises(ServerError, match=r"cannot listen on 192\.0\.2\.1"):
        open_page(host="192.0.2.1", port=0)


def test_nobody_can_ask_for_a_public_tunnel(page: Page) -> None:
    handlers = page.server._websock_server._incoming_handlers
    assert not handlers.get(_messages.ShareUrlRequest)


def test_a_stopped_server_frees_its_port() -> None:
    with serving(port=0) as server:
        port = server.get_port()
    with serving(port=port) as again:
        assert again.get_port() == port
