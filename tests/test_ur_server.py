"""The virtual controller's ports: plain sockets, garbage, a second server on the same address."""

import signal
import socket
import struct
from contextlib import suppress

import numpy as np
import pytest

from app.cli import main
from app.errors import RobotError, ServerError
from app.robot.ur import link as ur_link
from app.robot.ur.dashboard import dashboard
from app.robot.ur.link import Link
from app.robot.ur.wire import Kind, WireError, pack, split, unpack_values
from app.virtual.ur.controller import UrController
from app.virtual.ur.server import DASHBOARD, RTDE, SCRIPT, UrServer
from tests.virtual_ur import HOME, own_address


@pytest.fixture
def served():
    emulator = UrServer(UrController(HOME), own_address())
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
        UrServer(UrController(HOME), served.host).start()
    assert "\n" not in str(error.value)


def test_silence_and_strangers_are_told_apart(served, monkeypatch):
    monkeypatch.setattr(ur_link, "PATIENCE", 0.3)
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


def test_a_virtual_controller_begins_and_ends_by_its_command(capsys, monkeypatch):
    monkeypatch.setattr(signal, "signal", lambda *_: None)  # pytest keeps its own
    host = own_address()
    assert main(("ur", "emulate", "--host", host, "--seconds", "0.1")) == 0
    out, err = capsys.readouterr()
    assert host in out and err == ""


def states(served, wanted, begin):
    """`wanted` timestamps of the stream, after `begin` has been done to the controller."""
    with link(served, RTDE) as rtde:
        rtde.sendall(pack(Kind.OUTPUTS, struct.pack(">d", 500.0) + b"timestamp") + pack(Kind.START))
        rtde.recv(64)
        served.ask(begin)
        stamps, rest = [], b""
        while len(stamps) < wanted:
            more, rest = split(rest + rtde.recv(65536))
            stamps += [
                unpack_values(["DOUBLE"], p.payload[1:])[0] for p in more if p.kind == Kind.DATA
            ]
    return stamps


def test_what_a_stall_holds_up_comes_all_of_it(served):
    stamps = states(served, 150, lambda controller: controller.break_link("stall", 0.2))
    assert np.allclose(np.diff(stamps), 0.002)


def test_corrupt_states_are_no_rtde(served):
    with pytest.raises(WireError):
        states(served, 150, lambda controller: controller.break_link("corrupt", 0.2))


def test_a_silent_controller_answers_its_version_and_no_more(served):
    served.ask(lambda controller: controller.break_link("silent", 60.0))
    answer = b""
    for _ in range(20):  # a link that stood when the silence began is cut
        with link(served, RTDE) as rtde:
            rtde.settimeout(0.2)
            rtde.sendall(pack(Kind.VERSION, b"\x00\x02"))
            answer = rtde.recv(64)
            if not answer:
                continue
            rtde.sendall(pack(Kind.CONTROLLER))
            with suppress(TimeoutError):
                assert rtde.recv(64) == b""
            break
    assert answer == pack(Kind.VERSION, b"\x01")
