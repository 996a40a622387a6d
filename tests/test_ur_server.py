"""The virtual controller's ports: plain sockets, garbage, a second server on the same address."""

import socket
import struct

import numpy as np
import pytest

from app.errors import RobotError, ServerError
from app.robot.ur.dashboard import dashboard
from app.robot.ur.emulator.controller import Controller
from app.robot.ur.emulator.server import DASHBOARD, RTDE, SCRIPT, Emulator
from app.robot.ur.link import Link
from app.robot.ur.wire import Kind, pack, split, unpack_values
from tests.virtual_ur import HOME, own_address


@pytest.fixture
def served():
    emulator = Emulator(Controller(HOME), own_address())
    emulator.start()
    yield emulator
    emulator.stop()


def link(served, port):
    return socket.create_connection((served.host, port), timeout=5.0)


def test_states_are_streamed_to_a_plain_socket(served):
    with link(served, RTDE) as rtde:
        recipe = struct.pack(">d", 500.0) + b"timestamp,actual_q,"
        rtde.sendall(pack(Kind.OUTPUTS, recipe) + pack(Kind.START))
        packets, rest = [], b""
        while len(packets) < 12:
            more, rest = split(rest + rtde.recv(4096))
            packets += more
    assert packets[0].payload == b"\x01DOUBLE,VECTOR6D" and packets[1].payload == b"\x01"
    values = [unpack_values(["DOUBLE", "VECTOR6D"], p.payload[1:]) for p in packets[2:]]
    assert np.allclose(np.diff([t for t, _ in values]), 0.002)
    assert np.allclose(values[0][1], HOME)


@pytest.mark.parametrize("port", [RTDE, SCRIPT, DASHBOARD])
def test_garbage_sends_that_client_away_and_the_server_lives(served, port, caplog):
    with link(served, port) as wild:
        try:
            wild.sendall(b"\xff" * 300_000)
            while wild.recv(65536):
                pass
        except ConnectionError:
            pass  # sent away while it was still talking
    assert "sent away" in caplog.text
    Link(served.host).close()
    assert dashboard(served.host, "is in remote control") == ["true"]


def test_a_second_one_on_the_same_address_is_refused_in_one_line(served):
    with pytest.raises(ServerError, match=r"29999 cannot be opened .*--host") as error:
        Emulator(Controller(HOME), served.host).start()
    assert "\n" not in str(error.value)


def test_a_probe_tells_silence_and_strangers_apart(served):
    with pytest.raises(RobotError, match="check the address, the cable"):
        Link(own_address())
    served.ask(lambda controller: controller.break_link("mute", 5.0))
    with pytest.raises(RobotError, match=r"no answer|timed out"):
        Link(served.host).close()


def test_a_link_that_is_cut_ends_every_connection_and_comes_back(served):
    with link(served, RTDE) as rtde:
        rtde.sendall(pack(Kind.VERSION, b"\x00\x02"))
        assert rtde.recv(64)
        served.ask(lambda controller: controller.break_link("drop", 0.05))
        assert rtde.recv(64) == b""
    while served.ask(lambda controller: controller.cut):
        pass
    Link(served.host).close()
