"""The example of a TLS proxy, run as it stands but for its ports, files and name lookups."""

import re
import shutil
import signal
import socket
import ssl
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import viser
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from app.assets import asset_folder
from app.ui.page import Page
from tests.raw_page import play
from tests.ui_page import FakeEngine, the_engine  # noqa: F401 - fixtures

ORIGIN = "https://cell.example"
TOKEN = "a token for the proxy's test"
NEEDED = ("nginx", "openssl")


class Proxy(NamedTuple):
    """The proxy's ports on the loopback address, and who signed its certificate."""

    tls: int
    plain: int
    trust: ssl.SSLContext


@pytest.fixture(scope="module")
def page(engine: FakeEngine) -> Iterator[Page]:
    page = Page(engine, port=0, token=TOKEN, origins=(ORIGIN,))
    yield page
    page.server.stop()


def program(name: str) -> str:
    """Debian keeps nginx where only root's PATH looks."""
    found = shutil.which(name) or shutil.which(name, path="/usr/sbin:/usr/local/sbin")
    if found is None:
        pytest.skip(f"{name} is not installed (Debian: apt install {name})")
    return found


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as s:
        return int(s.getsockname()[1])


@pytest.fixture(scope="module")
def proxy(page: Page, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxy]:
    nginx, openssl = (program(name) for name in NEEDED)
    folder: Path = tmp_path_factory.mktemp("proxy")
    crt, key = folder / "cell.crt", folder / "cell.key"
    subprocess.run(
        [openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
         "-nodes", "-keyout", key, "-out", crt, "-days", "1", "-subj", "/CN=cell.example",
         "-addext", "subjectAltName=DNS:cell.example"],
        check=True, capture_output=True,
    )  # fmt: skip
    tls, plain = free_port(), free_port()
    text = (asset_folder("static_assets") / "proxy" / "nginx.conf").read_text("utf-8")
    for old, new in (
        ("/etc/flinch/cell.crt", str(crt)),
        ("/etc/flinch/cell.key", str(key)),
        ("/run/nginx-flinch.pid", str(folder / "pid")),
        ("/var/log/nginx/flinch.log", str(folder / "log")),
        ("listen 443 ssl", f"listen 127.0.0.1:{tls} ssl"),
        ("listen 80;", f"listen 127.0.0.1:{plain};"),
        ("http://127.0.0.1:8080", f"http://127.0.0.1:{page.server.get_port()}"),
    ):
        assert re.search(rf"^[^#\n]*{re.escape(old)}", text, re.MULTILINE), f"no {old} to replace"
        text = text.replace(old, new)
    # where only root may write, another user's nginx would not even start
    modules = subprocess.run([nginx, "-V"], check=True, capture_output=True).stderr.decode()
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    known = (k for k in kinds if f"--without-http_{k}_module" not in modules)
    paths = "".join(f"    {k}_temp_path {folder / k};\n" for k in known)
    text = text.replace("http {\n", f"http {{\n{paths}", 1)
    conf = folder / "nginx.conf"
    conf.write_text(text, "utf-8")
    command = [
        nginx,
        "-p",
        str(folder),
        "-c",
        str(conf),
        "-e",
        str(folder / "log"),
        "-g",
        "daemon off;",
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    try:
        _listens(process, tls)
        yield Proxy(tls, plain, ssl.create_default_context(cafile=str(crt)))
    finally:
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=10.0)
        print(said.decode())


def _listens(process: "subprocess.Popen[bytes]", port: int) -> None:
    for _ in range(500):
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            return
        except OSError:
            assert process.poll() is None, process.communicate()[1].decode()
            time.sleep(0.01)  # another process has to get ready; it has no clock of ours
    raise AssertionError("nginx does not listen")


def open_socket(
    proxy: Proxy, origin: str, headers: dict[str, str] | None = None, path: str = "/"
) -> connect:
    """A web socket through the proxy; the name is not looked up, the certificate is."""
    version: Any = f"viser-v{viser.__version__}"
    return connect(
        f"wss://cell.example:{proxy.tls}{path}",
        sock=socket.create_connection(("127.0.0.1", proxy.tls), timeout=5.0),
        ssl=proxy.trust,
        server_hostname="cell.example",
        origin=origin,  # type: ignore[arg-type]
        additional_headers=headers,
        subprotocols=[version],
        proxy=None,
        max_size=None,
    )


def get(proxy: Proxy, headers: dict[str, str], path: str = "/") -> Any:
    """Fetch the page's first file through TLS, as the browser does."""
    raw = socket.create_connection(("127.0.0.1", proxy.tls), timeout=5.0)
    with proxy.trust.wrap_socket(raw, server_hostname="cell.example") as s:
        lines = [f"{k}: {v}" for k, v in {"Host": "cell.example", **headers}.items()]
        s.sendall(
            "\r\n".join([f"GET {path} HTTP/1.1", *lines, "Connection: close", "", ""]).encode()
        )
        answer = b""
        while data := s.recv(65536):
            answer += data
    head, _, body = answer.partition(b"\r\n\r\n")
    return head.decode(), body


def test_the_page_loads_through_the_proxy(proxy: Proxy) -> None:
    head, body = get(proxy, {})
    assert head.startswith("HTTP/1.1 200")
    assert b"<script" in body
    assert "Strict-Transport-Security" in head and "X-Frame-Options: DENY" in head
    assert "Set-Cookie: flinch-" in head


def test_plain_http_is_sent_to_tls(proxy: Proxy) -> None:
    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *args: Any) -> None:
            return None

    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), Stay)
    request = urllib.request.Request(f"http://127.0.0.1:{proxy.plain}/", headers={"Host": "x"})
    with pytest.raises(urllib.error.HTTPError) as e:
        opener.open(request, timeout=5.0)
    assert (e.value.code, e.value.headers["Location"]) == (301, "https://cell.example/")
    e.value.close()


def test_the_web_socket_works_through_the_proxy(proxy: Proxy) -> None:
    async def scene() -> None:
        async with open_socket(proxy, ORIGIN) as page:
            assert len(await page.recv()) > 100  # the scene

    play(scene())


def test_the_page_and_its_socket_work_below_a_path(proxy: Proxy) -> None:
    assert "Location: https://cell.example" in get(proxy, {}, "/arm")[0]
    head, body = get(proxy, {}, "/arm/")
    assert head.startswith("HTTP/1.1 200") and b"<script" in body

    async def scene() -> None:
        async with open_socket(proxy, ORIGIN, path="/arm") as page:  # as viser's page asks for it
            assert len(await page.recv()) > 100

    play(scene())
    with pytest.raises(InvalidStatus) as e:
        play(_foreign(proxy))
    assert e.value.response.status_code == 403


async def _foreign(proxy: Proxy) -> None:
    async with open_socket(proxy, "https://evil.example", path="/arm"):
        pass


def test_nobody_can_pretend_to_come_from_another_address(proxy: Proxy, page: Page) -> None:
    async def scene() -> set[str]:
        async with open_socket(proxy, ORIGIN, {"X-Forwarded-For": "192.0.2.7"}) as client:
            await client.recv()
            known: dict[int, Any] = page.server._websock_server._live_connections
            return {connection.neighbourhood for connection in known.values()}

    assert play(scene()) == {"127.0.0.1"}


@pytest.mark.parametrize("origin", ["https://evil.example", "http://cell.example", "null"])
def test_a_foreign_origin_is_refused_through_the_proxy(proxy: Proxy, origin: str) -> None:
    async def scene() -> None:
        async with open_socket(proxy, origin):
            pass

    with pytest.raises(InvalidStatus) as e:
        play(scene())
    assert e.value.response.status_code == 403
    assert get(proxy, {"Origin": origin})[0].startswith("HTTP/1.1 403")
