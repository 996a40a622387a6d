"""Who may connect: the page's server, its address and its Origin check."""

import asyncio
import socket
from types import SimpleNamespace
from typing import Any

import pytest
import viser
import websockets as ws
import websockets.asyncio.server as ws_server
from viser import _messages
from viser.infra import _infra
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import InvalidStatus

from app.errors import ServerError
from app.timing import WallClock
from app.ui import knock
from app.ui.access import Access
from app.ui.gate import Gate
from app.ui.page import Page
from app.ui.server import close_page, open_page, page_url
from tests.ui_page import FakeEngine, serving, the_built, the_engine, the_page  # noqa: F401 - fixtures


def status(server: viser.ViserServer, origin: str | None, address: str = "") -> int:
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
    assert status(page.server, f"http://{name}:{page.server.get_port()}") == 101


def test_strangers_are_refused(page: Page) -> None:
    port = page.server.get_port()
    strangers = (
        "http://evil.example", f"http://evil.example:{port}", f"http://localhost:{port + 1}",
        f"https://localhost:{port}", f"http://localhost.evil.example:{port}", "null", None,
    )  # fmt: skip
    assert {origin: status(page.server, origin) for origin in strangers} == dict.fromkeys(
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
        assert status(page.server, near, near) == 101
        assert status(page.server, far, near) == 403
        assert status(page.server, "https://cell.example", near) == 403
    finally:
        page.server.stop()


def test_a_public_origin_is_let_in_where_it_was_named(engine: FakeEngine) -> None:
    page = Page(engine, port=0, token="x" * 16, origins=("https://cell.example",))
    try:
        assert status(page.server, "https://cell.example") == 101
        assert status(page.server, "https://cell.example:8443") == 403
        assert status(page.server, "http://cell.example") == 403
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


# --- what is not behind the door is not started ---------------------------------------------


def past_the_door(monkeypatch: pytest.MonkeyPatch) -> None:
    """viser reaches websockets by another name than the one that is led to the door."""
    real = SimpleNamespace(server=SimpleNamespace(serve=ws_server.serve))
    names = {"asyncio": real, "exceptions": ws.exceptions, "datastructures": ws.datastructures}
    monkeypatch.setattr(_infra, "websockets", SimpleNamespace(**names))


def without(monkeypatch: pytest.MonkeyPatch, option: str) -> None:
    """websockets forgets an option that it is given."""
    real = ws_server.serve

    def serve(*args: Any, **options: Any) -> Any:
        options.pop(option, None)
        return real(*args, **options)

    monkeypatch.setattr(ws_server, "serve", serve)


def no_origin_check(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "process_request")


def no_gate(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "create_connection")


def past_the_gate(monkeypatch: pytest.MonkeyPatch) -> None:
    """viser reads by another way than the one that is judged, and takes whatever it reads."""

    async def read(socket: Any, handle: Any, kind: Any) -> None:
        while True:
            raw = await ServerConnection.recv(socket)
            if isinstance(raw, bytes):
                handle(kind.deserialize(raw))

    monkeypatch.setattr(_infra, "_message_consumer", read)


def another_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viser.ViserServer, "get_port", lambda self: self._websock_server._port + 1)


def a_part_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(_infra.WebsockMessageHandler, "unregister_handler")


def another_viser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viser, "__version__", "1.2.0")


def an_option_that_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    real = ws_server.serve

    def serve(*args: Any, **options: Any) -> Any:
        return real(*args, **options, no_such_option=True)

    monkeypatch.setattr(ws_server, "serve", serve)


def viser_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise RuntimeError("no")

    monkeypatch.setattr(viser, "ViserServer", fails)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")  # its end
@pytest.mark.parametrize(
    ("change", "told"),
    [
        (past_the_door, "past the page's door"),
        (another_port, "past the page's door"),
        (no_origin_check, "a foreign Origin was let in"),
        (no_gate, "by sockets that are not ours"),
        (past_the_gate, "nonsense was answered"),
        (a_part_is_gone, "it has no _websock_server.unregister_handler"),
        (another_viser, r"viser 1\.2\.0 cannot be guarded"),
        (an_option_that_is_not_known, "cannot be started behind the page's door"),
        (viser_fails, "cannot be started behind the page's door"),
    ],
)
def test_a_page_that_is_not_behind_the_door_is_not_started(
    change: Any, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    monkeypatch.setattr(knock, "PATIENCE", 1.0)
    with monkeypatch.context() as changed:
        change(changed)
        with pytest.raises(ServerError, match=told) as e:
            open_page(port=port)
    assert "\n" not in str(e.value)
    for given in (port, port + 1):  # the next one is where viser goes when it is left alone
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", given), timeout=5.0)
    with serving(port=port) as server:
        assert server.get_port() == port


def test_trying_the_door_leaves_nothing_behind_and_says_nothing(
    caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    gate = Gate(Access(), WallClock())
    server = open_page(port=0, gate=gate)
    try:
        assert server.get_clients() == {} and gate.refused == 0 and gate.free == set()
        assert gate.access.operator is None
    finally:
        close_page(server)
    assert caplog.records == [] and capfd.readouterr() == ("", "")


def test_a_stopped_server_frees_its_port() -> None:
    with serving(port=0) as server:
        port = server.get_port()
    with serving(port=port) as again:
        assert again.get_port() == port
