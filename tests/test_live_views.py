"""Live views: a viewer sees the run, can do nothing to it, and no web page looks in unasked."""

import asyncio
import base64
import json
import struct
from contextlib import asynccontextmanager

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.cli import main
from app.errors import ConfigError, ServerError
from app.messages import Status
from app.record.views.clouds import PACKED
from app.record.views.schemas import SCHEMAS, schemas_of
from app.timing import ManualClock
from app.ui.live import server as live_server
from app.ui.live.protocol import MESSAGE_DATA, SUBPROTOCOLS
from app.ui.live.server import LiveViews
from app.ui.live.viewer import LOG_ROOM, Viewer
from app.ui.live.window import viewer_origin
from app.wiring import Setup, build_engine
from tests.raw_page import play

FOREIGN = "https://evil.example"


@pytest.fixture(scope="module")
def engine():
    made = build_engine(Setup(scene="cell", seed=1), ManualClock())
    for _ in range(100):
        made.step()
    yield made
    made.close()


@pytest.fixture
def live(engine):
    views = LiveViews(engine, 0, ("https://viewer.example",))
    views.start()
    yield views
    views.stop()


class Looker:
    """A viewer: a real web socket, and what it was told."""

    def __init__(self, socket):
        self.socket = socket
        self.channels = {}

    async def hello(self):
        self.info = json.loads(await self.socket.recv())
        for c in json.loads(await self.socket.recv())["channels"]:
            self.channels[c["topic"]] = c
        return self

    async def say(self, **fields):
        await self.socket.send(json.dumps(fields))

    async def want(self, *topics):
        wishes = [{"id": i, "channelId": self.channels[t]["id"]} for i, t in enumerate(topics, 50)]
        await self.say(op="subscribe", subscriptions=wishes)

    async def message(self):
        """Subscription, time [ns] and message of the next data."""
        raw = await self.socket.recv()
        assert isinstance(raw, bytes), raw
        op, subscription, at_ns = MESSAGE_DATA.unpack(raw[: MESSAGE_DATA.size])
        assert op == 1
        return subscription, at_ns, raw[MESSAGE_DATA.size :]


@asynccontextmanager
async def looking(live, **options):
    options = {"subprotocols": SUBPROTOCOLS[:1], "max_size": None, **options}
    async with connect(live.url, **options) as socket:
        yield await Looker(socket).hello()


def test_a_viewer_is_told_every_topic_with_a_schema_that_it_can_use(live, engine):
    schemas = schemas_of(engine.robot)

    async def scene():
        async with looking(live) as viewer:
            assert viewer.socket.subprotocol == "foxglove.sdk.v1"
            assert viewer.info["op"] == "serverInfo" and viewer.info["capabilities"] == []
            assert set(viewer.channels) == set(schemas) > set(SCHEMAS)
            for topic, channel in viewer.channels.items():
                assert channel["encoding"] == channel["schemaEncoding"] == "protobuf"
                assert channel["schemaName"] == schemas[topic].DESCRIPTOR.full_name
                files = FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
                names = {f"{f.package}.{m.name}" for f in files.file for m in f.message_type}
                assert channel["schemaName"] in names

    play(scene())


def test_a_point_cloud_and_the_robot_arrive_at_a_viewer_that_wants_them(live, engine):
    async def scene():
        async with looking(live, subprotocols=SUBPROTOCOLS[1:]) as viewer:
            await viewer.want("/points/kept", "/robot")
            got = {}
            while len(got) < 2:
                subscription, at_ns, data = await viewer.message()
                got[subscription] = data
            cloud = SCHEMAS["/points/kept"].FromString(got[50])
            points = np.frombuffer(cloud.data, dtype=PACKED)
            assert len(points) == len(engine.snapshots.get()[0].cloud.kept())
            assert cloud.timestamp.ToNanoseconds() == at_ns > 1_700_000_000 * 10**9
            robot = SCHEMAS["/robot"].FromString(got[51])
            assert [e.id for e in robot.entities] == list(engine.robot.links)

    play(scene())


def test_who_comes_later_is_told_what_was_told_once(live):
    async def scene():
        async with looking(live) as first, looking(live) as second:
            await first.want("/robot")
            a = await first.message()
            await second.want("/robot")
            assert (await second.message())[1:] == a[1:]

    play(scene())


def test_what_is_no_longer_wanted_is_no_longer_sent(live, engine):
    async def scene():
        async with looking(live) as viewer:
            await viewer.want("/tf", "/goal")
            await viewer.message()
            await viewer.say(op="unsubscribe", subscriptionIds=[50])
            await viewer.say(op="getParameters", parameterNames=[])
            while isinstance(await viewer.socket.recv(), bytes):  # until it is answered
                pass
            for _ in range(3):
                engine.step()
                assert (await viewer.message())[0] == 51

    play(scene())


@pytest.mark.parametrize(
    "attempt",
    [
        json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/goal", "encoding": "json",
                                                     "schemaName": "x"}]}),
        struct.pack("<BI", 1, 1) + b"{}",  # the data of a channel of its own
        json.dumps({"op": "setParameters", "parameters": [{"name": "mode", "value": "qp"}]}),
        struct.pack("<BIII", 2, 1, 1, 4) + b"json{}",  # a service
        json.dumps({"op": "fetchAsset", "uri": "file:///etc/passwd", "requestId": 1}),
    ],
    ids=["publish", "data", "parameters", "service", "asset"],
)  # fmt: skip
def test_whatever_a_viewer_tries_it_may_only_look(live, engine, attempt):
    async def scene():
        async with looking(live) as viewer:
            await viewer.socket.send(attempt)
            status = json.loads(await viewer.socket.recv())
            assert status["op"] == "status" and status["level"] == 2
            assert "only shows" in status["message"]
            before = engine.step().goal
            await viewer.want("/goal")  # it still sees, and nothing has changed
            goal = SCHEMAS["/goal"].FromString((await viewer.message())[2])
            assert goal.pose.position.x == before.T_base_tool[0, 3]

    play(scene())


@pytest.mark.parametrize("origin", [FOREIGN, "null", "http://127.0.0.1:8080", "http://localhost"])
def test_a_page_from_elsewhere_is_refused(live, origin, caplog):
    async def scene():
        with pytest.raises(InvalidStatus) as refused:
            async with looking(live, origin=origin):
                pass
        assert refused.value.response.status_code == 403

    play(scene())
    assert f"--foxglove-origin {origin}" in caplog.text


def test_a_page_that_was_named_and_a_desktop_viewer_are_let_in(live):
    async def scene():
        for origin in ("https://viewer.example", "file://", None):
            async with looking(live, origin=origin) as viewer:
                assert viewer.channels

    play(scene())


def test_a_second_origin_beside_a_known_one_is_refused(live):
    async def scene():
        with pytest.raises(InvalidStatus):
            async with looking(live, additional_headers=[("Origin", "file://"),
                                                         ("Origin", FOREIGN)]):  # fmt: skip
                pass

    play(scene())


def test_what_speaks_another_protocol_is_refused(live):
    async def scene():
        for wrong in (None, ["viser-v1.1.1"]):
            with pytest.raises(InvalidStatus) as refused:
                async with looking(live, subprotocols=wrong):
                    pass
            assert refused.value.response.status_code == 400

    play(scene())


def test_nonsense_ends_the_connection_of_who_sent_it(live):
    async def scene():
        for text in ("{", "[]", '{"op": 3}', '{"op": "subscribe", "subscriptions": [{"id": -1}]}'):
            async with looking(live) as viewer:
                await viewer.socket.send(text)
                with pytest.raises(ConnectionClosed) as closed:
                    await viewer.socket.recv()
                assert closed.value.rcvd.code == 1003

    play(scene())


def test_a_flood_and_a_giant_end_their_connection(live):
    async def scene():
        async with looking(live) as viewer:
            with pytest.raises(ConnectionClosed):
                for _ in range(1000):
                    await viewer.say(op="unsubscribe", subscriptionIds=[])
                await viewer.socket.recv()
        async with looking(live) as viewer:
            with pytest.raises(ConnectionClosed):
                await viewer.socket.send("x" * (1 << 17))
                await viewer.socket.recv()

    play(scene())


def test_a_fifth_viewer_is_turned_away(live):
    async def scene():
        async with looking(live), looking(live), looking(live), looking(live):
            with pytest.raises(InvalidStatus) as refused:
                async with looking(live):
                    pass
            assert refused.value.response.status_code == 503

    play(scene())


def test_for_a_slow_viewer_only_the_newest_of_each_topic_waits_and_the_last_of_the_log():
    viewer = Viewer.__new__(Viewer)
    viewer._wanted, viewer._waiting, viewer._some = {"/tf": 1, "/log": 2}, {}, asyncio.Event()
    for i in range(LOG_ROOM + 5):
        for topic in ("/tf", "/log", "/goal"):
            viewer.put(topic, i, b"%d" % i)
    assert viewer._waiting["/tf"] == [(LOG_ROOM + 4, b"%d" % (LOG_ROOM + 4))]
    assert [i for i, _ in viewer._waiting["/log"]] == list(range(5, LOG_ROOM + 5))
    assert "/goal" not in viewer._waiting


def test_nothing_is_made_while_nobody_looks(live, engine, monkeypatch):
    monkeypatch.setattr(live._views, "of", lambda *_: pytest.fail("made for nobody"))
    engine.step()
    live.step()


def test_views_that_fail_end_their_server_and_not_the_arm(engine, caplog, monkeypatch):
    views = LiveViews(engine, 0)

    def fail(*_):
        raise RuntimeError("a view is broken")

    monkeypatch.setattr(views._views, "of", fail)
    views.start()

    async def scene():
        async with looking(views) as viewer:
            await viewer.want("/tf")
            with pytest.raises(ConnectionClosed):
                await viewer.socket.recv()

    play(scene())
    views.stop()
    assert "the live views have failed" in caplog.text
    assert isinstance(engine.step().status, Status)


def test_a_taken_port_is_one_line_and_it_is_loopback_alone(live, engine):
    assert live.url.startswith("ws://127.0.0.1:") and live_server.HOST == "127.0.0.1"
    with pytest.raises(ServerError, match=r"port \d+ on 127.0.0.1 is taken") as error:
        LiveViews(engine, live.port)
    assert "\n" not in str(error.value)


def test_it_may_be_stopped_twice_or_without_a_start(engine):
    views = LiveViews(engine, 0)
    views.stop()
    views.stop()


def test_an_origin_is_written_as_browsers_write_it():
    assert viewer_origin("HTTPS://App.Foxglove.dev/") == "https://app.foxglove.dev"
    assert viewer_origin("http://localhost:8090") == "http://localhost:8090"
    for text in ("null", "*", "app.foxglove.dev", "https://a/b", "https://", "https://*"):
        with pytest.raises(ConfigError, match="is no address of a page"):
            viewer_origin(text)


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (["--foxglove", "1", "2"], "give one port"),
        (["--foxglove", "70000"], "port = 70000"),
        (["--foxglove-origin", "https://a.example"], "add --foxglove"),
        (["--headless", "--foxglove"], "leave --headless out"),
        (["--foxglove", "--foxglove-origin", "null"], "no address of a page"),
    ],
)
def test_flags_that_do_not_fit_are_one_line(flags, says, capsys):
    assert main(["run", *flags]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line
