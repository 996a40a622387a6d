"""Strangers at the door: crowds, floods and silence; the operator stays, and Stop is heard."""

import asyncio
import errno
import logging
import socket
from asyncio import constants
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.actions import SetMode
from app.messages import Mode
from app.timing import ManualClock
from app.ui import door
from app.ui.access import TRY_AGAIN
from app.ui.connection import RATE
from app.ui.door import ALL_OPENINGS, FILES_BURST, MOST_WAITING, OPENINGS
from app.ui.page import Page
from tests.raw_page import CAMERA, RawPage, play, raw_page, told, until
from tests.ui_page import FakeEngine, the_engine  # noqa: F401 - fixtures

TOKEN = "a token of a test, long enough"
NEIGHBOUR = "127.0.0.2"  # this machine too, but another address: a stranger on the network
MOST_PAGES = 6  # here: opening one takes a tenth of a second
PING = b"\x89\x80\0\0\0\0"  # a whole frame


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(100.0)


@pytest.fixture
def page(engine: FakeEngine, clock: ManualClock) -> Iterator[Page]:
    engine.posted.clear()
    page = Page(engine, port=0, clock=clock)
    yield page
    page.server.stop()


@pytest.fixture
def guarded(engine: FakeEngine, clock: ManualClock) -> Iterator[Page]:
    """A page that takes a token."""
    engine.posted.clear()
    page = Page(engine, port=0, clock=clock, token=TOKEN)
    yield page
    page.server.stop()


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "MOST_PAGES", MOST_PAGES)
    monkeypatch.setattr(door, "OPENINGS_BURST", 2.0 * MOST_PAGES)


@pytest.fixture(autouse=True)
def log(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    caplog.set_level(logging.WARNING)
    return caplog


def control(page: Page, label: str) -> Any:
    known = page.server.gui._gui_input_handle_from_uuid.values()
    return next(h for h in known if h._impl.props.label == label)


async def stops(page: Page, who: RawPage, engine: FakeEngine) -> None:
    """Its Stop reaches the engine."""
    engine.posted.clear()
    await who.press(control(page, "Stop"))
    await until(lambda: engine.posted)
    (stop,) = engine.posted
    assert isinstance(stop, SetMode) and stop.mode is Mode.STOPPED


async def operates(page: Page, who: RawPage, engine: FakeEngine) -> None:
    """It runs and stops the arm."""
    engine.posted.clear()
    await who.press(control(page, "Run"))
    await until(lambda: engine.posted)
    assert [a.mode for a in engine.posted if isinstance(a, SetMode)] == [Mode.RUNNING]
    await stops(page, who, engine)


async def tell(page: Page, who: RawPage, token: str) -> None:
    panel = page.roles.panels[who.number]
    await who.press(panel.token, token)
    await who.press(panel.button)


@asynccontextmanager
async def crowd(
    page: Page, clock: ManualClock, number: int, **way: Any
) -> AsyncIterator[list[Any]]:
    """Pages of strangers, as many and as fast as they are let in."""
    async with AsyncExitStack() as stack:
        strangers = []
        for _ in range(number):
            clock.t += 1.0 / min(OPENINGS, ALL_OPENINGS)
            strangers.append(await stack.enter_async_context(raw_page(page.server, **way)))
        yield strangers


# --- places ---------------------------------------------------------------------------------


def test_strangers_who_fill_the_places_do_not_keep_out_who_knows_the_token(
    guarded: Page, engine: FakeEngine, clock: ManualClock, log: Any
) -> None:
    async def scene() -> None:
        async with crowd(guarded, clock, MOST_PAGES) as strangers:
            assert len(guarded.server.get_clients()) == MOST_PAGES
            async with raw_page(guarded.server) as me:
                await stops(guarded, me, engine)
                await tell(guarded, me, TOKEN)
                await until(lambda: guarded.access.operator == me.number)
                assert await strangers[0].closed() == 1013  # the first that came
                assert len(guarded.server.get_clients()) == MOST_PAGES
                async with crowd(guarded, clock, MOST_PAGES):
                    await operates(guarded, me, engine)

    play(scene())
    assert len(told(log)) <= 2


def test_on_ones_own_machine_scripts_cannot_push_the_operator_out(
    page: Page, engine: FakeEngine, clock: ManualClock
) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as me:
            async with crowd(page, clock, 2 * MOST_PAGES):
                await operates(page, me, engine)
            assert page.access.operator == me.number

    play(scene())


def test_a_flood_of_one_address_pushes_itself_out(
    guarded: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    async def scene() -> None:
        async with (
            raw_page(guarded.server) as watcher,  # it came first, but it is alone
            crowd(guarded, clock, MOST_PAGES + 3, local_addr=(NEIGHBOUR, 0)) as flood,
        ):
            assert await flood[0].closed() == 1013
            await stops(guarded, watcher, engine)

    play(scene())


def test_a_browser_that_has_operated_finds_a_place_when_strangers_do_not(
    page: Page, engine: FakeEngine, log: Any
) -> None:
    """Its cookie opens nothing; but it does not have to share the strangers' luck."""

    async def scene() -> None:
        mine = cookie(page)
        async with raw_page(page.server, headers=mine) as me:
            assert page.access.operator == me.number
        async with AsyncExitStack() as stack:
            with pytest.raises(InvalidStatus) as e:
                while True:  # the clock stands still
                    await stack.enter_async_context(raw_page(page.server, headers=cookie(page)))
            assert e.value.response.status_code == 429
            async with raw_page(page.server, headers=mine) as again:
                await stops(page, again, engine)

    play(scene())
    assert "too many were opened" in log.text


def test_behind_a_proxy_a_page_comes_from_where_the_proxy_says(
    engine: FakeEngine, clock: ManualClock
) -> None:
    def whence(page: Page, *, through_proxy: bool) -> str:
        async def scene() -> str:
            headers = {"X-Forwarded-For": "127.9.9.9, 192.0.2.7"} if through_proxy else None
            async with raw_page(page.server, headers=headers) as one:
                return str(page.gate.inside.socket(one.number).neighbourhood)

        return play(scene())

    for origins, address in (((), "127.0.0.1"), (("https://cell.example",), "192.0.2.7")):
        page = Page(engine, port=0, clock=clock, token=TOKEN, origins=origins)
        try:
            assert whence(page, through_proxy=True) == address
            assert whence(page, through_proxy=False) == "127.0.0.1"
        finally:
            page.server.stop()


def test_where_all_are_trusted_a_stranger_is_turned_away(
    guarded: Page, clock: ManualClock, log: Any
) -> None:
    async def scene() -> None:
        async with crowd(guarded, clock, MOST_PAGES) as friends:
            for friend in friends:
                clock.t += TRY_AGAIN
                await tell(guarded, friend, TOKEN)
                await until(lambda n=friend.number: guarded.access.trusts(n))  # type: ignore[misc]
            with pytest.raises(InvalidStatus) as e:
                async with raw_page(guarded.server):
                    pass
            assert e.value.response.status_code == 503

    play(scene())
    assert "6 are open" in log.text


def cookie(page: Page) -> dict[str, str]:
    """What a browser is given with the page, as it sends it back."""
    with socket.create_connection(("127.0.0.1", page.server.get_port()), timeout=5.0) as s:
        s.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        head = b""
        while b"\r\n\r\n" not in head:
            head += s.recv(65536)
    (line,) = [x for x in head.decode("latin-1").split("\r\n") if x.startswith("Set-Cookie: ")]
    assert "HttpOnly" in line and "SameSite" in line
    return {"Cookie": line.removeprefix("Set-Cookie: ").partition(";")[0]}


# --- the token ------------------------------------------------------------------------------


def test_guesses_of_many_pages_are_judged_one_a_second_and_the_right_token_gets_its_turn(
    guarded: Page, engine: FakeEngine, clock: ManualClock, log: Any
) -> None:
    async def scene() -> None:
        async with crowd(guarded, clock, 4) as strangers, raw_page(guarded.server) as me:
            for k, stranger in enumerate(strangers):
                await tell(guarded, stranger, f"guess number {k} of them all")
            lines = [guarded.roles.panels[s.number].line for s in strangers]
            await until(lambda: sum("waits for its turn" in x.content for x in lines) == 3)
            assert sum("not the operator token" in x.content for x in lines) == 1
            await tell(guarded, me, TOKEN)
            line = guarded.roles.panels[me.number].line
            await until(lambda: "waits for its turn, with 3 before it" in line.content)
            for turn in range(4):
                assert guarded.access.operator is None
                clock.t += TRY_AGAIN
                left = f"with {2 - turn} before it" if turn < 3 else "You operate the arm"
                await until(lambda left=left: left in line.content)  # type: ignore[misc]
            assert guarded.access.operator == me.number
            await operates(guarded, me, engine)

    play(scene())
    assert sum("control refused" in line for line in told(log)) == 1


# --- floods on an open socket ---------------------------------------------------------------


async def late(page: Page) -> float:
    """How long the thread of the sockets keeps a call waiting [s]."""
    loop, here = page.server.get_event_loop(), asyncio.get_running_loop()
    begin = here.time()
    await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(asyncio.sleep(0), loop))
    return here.time() - begin


@pytest.mark.parametrize(
    ("frame", "number"),
    [(PING, 50_000), (b"\x8a\x80\0\0\0\0", 50_000), (b"\0\x80\0\0\0\0", 50_000)],
    ids=["pings", "pongs", "parts of a message"],
)
def test_a_flood_of_small_frames_ends_its_connection_and_holds_nobody_up(
    page: Page, engine: FakeEngine, log: Any, frame: bytes, number: int
) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as me, raw_page(page.server) as stranger:
            begin = b"\x02\x80\0\0\0\0" if frame[0] == 0 else b""  # of a message that never ends
            stranger.socket.transport.write(begin + frame * number)
            await stops(page, me, engine)
            assert await late(page) < 0.5
            assert await stranger.closed() in (1008, 1006)

    play(scene())
    assert f"more than {RATE:g} frames a second; closed" in log.text
    assert len(told(log)) == 1


def test_more_bytes_than_a_page_sends_end_its_connection(page: Page, log: Any) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as stranger:
            for _ in range(40):  # fewer than the frames that are too many
                await stranger.say("CommandTriggerMessage", uuid="x" * 60_000)
            assert await stranger.closed() in (1008, 1006)

    play(scene())
    assert "more than 256 kB a second; closed" in log.text and len(told(log)) == 2


def test_however_much_others_send_a_watchers_stop_passes(
    page: Page, engine: FakeEngine, log: Any
) -> None:
    """Each of the two sends less than what ends a connection; together it is too much."""

    async def scene() -> None:
        async with (
            raw_page(page.server) as operator,
            raw_page(page.server) as watcher,
            raw_page(page.server) as one,
            raw_page(page.server) as other,
        ):
            for _ in range(150):
                await one.say(**CAMERA)
                await other.say(**CAMERA)
            await until(lambda: page.gate.refused > 0)
            await stops(page, watcher, engine)
            await operates(page, operator, engine)
            assert len(page.server.get_clients()) == 4

    play(scene())
    (line,) = told(log)
    assert line.endswith("refused more messages than all who watch may send together")


def test_a_stop_right_before_the_page_is_closed_is_heard(page: Page, engine: FakeEngine) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as me:
            await me.press(control(page, "Stop"))
            await me.socket.close()
            await until(lambda: engine.posted)

    play(scene())


# --- sockets that are no page ---------------------------------------------------------------


def test_sockets_that_say_nothing_are_closed_when_there_are_too_many(
    page: Page, engine: FakeEngine, log: Any
) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as me:
            silent = [
                await asyncio.open_connection("127.0.0.1", page.server.get_port())
                for _ in range(2 * MOST_WAITING)
            ]
            for reader, _ in silent[:MOST_WAITING]:
                with suppress(ConnectionResetError):
                    assert await asyncio.wait_for(reader.read(), 5.0) == b""
            await stops(page, me, engine)
            async with raw_page(page.server) as another:
                await stops(page, another, engine)
            for _, writer in silent:
                writer.close()

    play(scene())
    assert "more than 48 sockets waited; closed one" in log.text
    assert len(told(log)) <= 2  # and one of closed sockets that have asked for nothing


def test_a_request_without_an_end_is_cut_off(page: Page, log: Any) -> None:
    async def scene() -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", page.server.get_port())
        writer.write(b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20 + b"X: " + b"y" * 8000 + b"\r\n")
        writer.write(b"X: " + b"y" * 8000 + b"\r\nX: " + b"y" * 8000)
        with suppress(ConnectionResetError):
            assert await asyncio.wait_for(reader.read(), 5.0) == b""
        writer.close()

    play(scene())
    assert "a request of more than 16 kB; closed" in log.text


@pytest.mark.parametrize("protocols", [None, ["chat"]])
def test_a_socket_that_does_not_speak_as_a_page_takes_no_place(
    page: Page, log: Any, capfd: pytest.CaptureFixture[str], protocols: Any
) -> None:
    async def scene() -> None:
        for _ in range(3):
            with pytest.raises(InvalidStatus) as e:
                async with connect(
                    page.url.replace("http", "ws"), origin=page.url, subprotocols=protocols,
                    proxy=None,
                ):  # fmt: skip
                    pass
            assert e.value.response.status_code == 400

    play(scene())
    assert len(told(log)) == 1
    assert "viser" not in capfd.readouterr().out


def test_a_page_of_an_older_viser_is_told_to_reload(
    page: Page, log: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    async def scene() -> None:
        for _ in range(3):
            protocols: Any = ["viser-v0.0.1"]
            async with connect(
                page.url.replace("http", "ws"), origin=page.url, subprotocols=protocols, proxy=None
            ) as socket:  # fmt: skip
                with pytest.raises(ConnectionClosed) as e:
                    await socket.recv()
                assert e.value.rcvd is not None and e.value.rcvd.code == 1002
                assert "reload it" in e.value.rcvd.reason

    play(scene())
    assert len(told(log)) == 1
    assert "viser" not in capfd.readouterr().out


def test_files_are_given_so_often_and_no_more(page: Page) -> None:
    async def ask() -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", page.server.get_port())
        writer.write(b"GET /none HTTP/1.1\r\nHost: x\r\n\r\n")
        answer = await reader.readline()
        writer.close()
        return answer

    async def scene() -> list[bytes]:
        return [await ask() for _ in range(round(FILES_BURST) + 5)]

    answers = play(scene())
    assert b"404" in answers[0] and b"429" in answers[-1]


def test_pages_that_come_and_go_are_let_in_so_often_and_told_of_once(
    page: Page, engine: FakeEngine, log: Any
) -> None:
    async def scene() -> None:
        async with raw_page(page.server) as me:
            for _ in range(30):
                with suppress(InvalidStatus):
                    async with raw_page(page.server) as stranger:
                        await stranger.raw("rubbish")
                        await stranger.closed()
            await stops(page, me, engine)

    play(scene())
    assert len(told(log)) == 2  # a page that was closed, and one that was not let in
    assert page.gate.refused >= 30


# --- the listener ---------------------------------------------------------------------------


def test_connections_of_one_address_are_let_in_so_often(
    page: Page, engine: FakeEngine, log: Any
) -> None:
    async def scene() -> None:
        port = page.server.get_port()
        async with raw_page(page.server) as me:
            for _ in range(250):
                s = socket.create_connection(
                    ("127.0.0.1", port), timeout=5.0, source_address=(NEIGHBOUR, 0)
                )
                s.close()
            async with raw_page(page.server) as another:  # from another address
                await stops(page, another, engine)
            await stops(page, me, engine)

    play(scene())
    assert "too many connections from 127.0.0.2: closed" in log.text
    assert len(told(log)) <= 3


def test_without_file_handles_open_pages_go_on_and_the_log_stays_short(
    page: Page, engine: FakeEngine, log: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    accept = socket.socket.accept
    monkeypatch.setattr(constants, "ACCEPT_RETRY_DELAY", 0.02)

    def none_left(self: socket.socket) -> Any:
        raise OSError(errno.EMFILE, "Too many open files")

    async def scene() -> None:
        async with raw_page(page.server) as me:
            monkeypatch.setattr(socket.socket, "accept", none_left)
            outside = socket.create_connection(("127.0.0.1", page.server.get_port()), timeout=5.0)
            for _ in range(5):
                await stops(page, me, engine)
                await asyncio.sleep(0.05)  # asyncio tries again meanwhile, in a time of its own
            monkeypatch.setattr(socket.socket, "accept", accept)
            outside.close()
            async with raw_page(page.server) as another:
                await stops(page, another, engine)

    play(scene())
    first = "no page can come for a second: no file handles are left (ulimit -n)"
    assert told(log)[0] == first
    assert len(told(log)) <= 2  # and one of `outside`, which has asked for nothing
