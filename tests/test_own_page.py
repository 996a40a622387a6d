"""The page's own script and style are in what a browser is handed out, however it asks."""

import gzip
import http.client
from collections.abc import Iterator

import pytest

from app.errors import ServerError
from app.ui.own_page import MARK, added, dressed
from app.ui.page import Page
from tests.ui_page import FakeEngine, the_engine  # noqa: F401 - fixtures


@pytest.fixture(scope="module")
def page(engine: FakeEngine) -> Iterator[Page]:
    page = Page(engine, port=0)
    yield page
    page.server.stop()


@pytest.mark.parametrize("packed", [True, False])
def test_the_script_is_in_the_page(page: Page, packed: bool) -> None:
    asks = http.client.HTTPConnection("127.0.0.1", page.server.get_port(), timeout=10.0)
    asks.request("GET", "/", headers={"Accept-Encoding": "gzip" if packed else "identity"})
    answer = asks.getresponse()
    body = answer.read()
    asks.close()
    assert answer.getheader("Content-Length") == str(len(body))
    whole = gzip.decompress(body) if packed else body
    assert whole.count(f"<script data-{MARK}>".encode()) == 1
    assert whole.index(MARK.encode()) < whole.rindex(b"</head>") < whole.rindex(b'id="root"')


def test_the_script_ends_no_tag_of_its_own() -> None:
    assert added().count("</script>") == added().count("</style>") == 1


def test_a_page_without_a_head_is_refused() -> None:
    with pytest.raises(ServerError, match=r"constraints\.txt"):
        dressed(b"<html></html>", False)
