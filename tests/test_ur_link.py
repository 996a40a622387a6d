"""Joint states of a virtual UR: of one packet, without a wait, and garbage is a fault in words."""

import contextlib
import socket
import struct
import threading

import numpy as np
import pytest

from app.errors import RobotError
from app.robot.ur import link, stream
from app.robot.ur.link import RTDE, Link
from app.robot.ur.stream import Stream
from app.robot.ur.wire import Kind, pack, split
from app.virtual.ur import controller, rtde
from app.virtual.ur.controller import UrController
from app.virtual.ur.faults import LINKS
from app.virtual.ur.rtde import RtdeClient
from tests.virtual_ur import CLOCK, HOME, LONGEST, VirtualUr, own_address


@contextlib.contextmanager
def talker(garbage=b""):
    """A controller that shakes hands and sends one state, then `garbage` when it is told to."""
    client, host, go = RtdeClient(UrController(HOME), {}), own_address(), threading.Event()

    def talk():
        with listening.accept()[0] as peer:
            rest = b""
            while not client.started and (data := peer.recv(4096)):
                packets, rest = split(rest + data)
                peer.sendall(b"".join(map(client.take, packets)))
            states = (client.data() for _ in range(4))  # an older series sends every fourth
            peer.sendall(b"".join(states))
            go.wait()
            peer.sendall(garbage)
            peer.recv(1)  # until the other side leaves

    with socket.create_server((host, RTDE)) as listening:
        thread = threading.Thread(target=talk, daemon=True)
        thread.start()
        yield host, go.set
        go.set()
        thread.join()


def fault_after(garbage):
    """What a link says that is sent `garbage` behind its states."""
    with talker(garbage) as (host, go):
        states = Link(host)
        go()
        end = CLOCK.now() + 0.5
        while not states.fault and CLOCK.now() < end:
            states.drain()
        states.close()
    assert np.allclose(states.newest.q, HOME)
    return states.fault


STATE = bytes(1 + struct.calcsize(">d12d2i2I2d"))


@pytest.mark.parametrize(
    ("garbage", "words"),
    [
        (b"\x00\x00\x00\x00", "claims 0 bytes"),
        (b"\xff" * 5000, "claims 65535 bytes"),
        (pack(Kind.DATA, STATE[:-1]), "a state of 136 bytes"),
        (pack(Kind.DATA), "a state of 0 bytes"),
        (pack(Kind.DATA, STATE[:1] + b"\xff" * (len(STATE) - 1)), "not finite"),
        (pack(ord("?"), b"what"), "kind 63"),
    ],
)
def test_bytes_that_are_no_state_are_a_fault_in_words_and_the_last_state_stays(garbage, words):
    fault = fault_after(garbage)
    assert "garbled" in fault and words in fault and "check the cable" in fault


def test_what_a_controller_says_in_words_is_no_fault():
    assert fault_after(pack(Kind.TEXT, b"hello") + pack(Kind.DATA, STATE)[:50]) == ""


def test_a_controller_without_a_variable_is_told_to_be_updated(monkeypatch):
    monkeypatch.delitem(rtde.OUTPUTS, "target_speed_fraction")
    with talker() as (host, _), pytest.raises(RobotError, match="update its Polyscope"):
        Link(host)


@pytest.mark.parametrize(("version", "rate"), [((3, 15, 8, 0), 125.0), ((5, 15, 0, 126), 500.0)])
def test_an_older_series_is_asked_for_as_many_states_as_it_has(monkeypatch, version, rate):
    asked = []
    monkeypatch.setattr(controller, "VERSION", version)
    setup = rtde.output_setup
    monkeypatch.setattr(rtde, "output_setup", lambda p: asked.append(setup(p)[0]) or setup(p))
    with talker() as (host, _):
        Link(host).close()
    assert asked == [rate]


def test_a_controller_that_answers_its_version_and_then_nothing_is_refused_in_time():
    with VirtualUr("silent") as ur:
        begin = CLOCK.now()
        with pytest.raises(RobotError, match="no answer") as error:
            Stream(ur.host)
        assert CLOCK.now() - begin < 4.0
    assert "\n" not in str(error.value) and ur.host in str(error.value)


def test_position_and_time_are_of_one_packet():
    with VirtualUr() as ur:
        ur.move(0.3)
        states, samples = Link(ur.host), {}
        end = CLOCK.now() + 1.0
        while CLOCK.now() < end:
            states.drain()
            sample = states.newest
            if sample.qd[3] == pytest.approx(0.3):
                samples[sample.timestamp] = sample.q[3]
        states.close()
    t, q = np.array(list(samples)), np.array(list(samples.values()))
    assert len(t) > 30 and np.allclose(q - 0.3 * t, q[0] - 0.3 * t[0], atol=1e-9)


def test_states_on_our_clock_lie_on_the_line_of_the_motion():
    with VirtualUr() as ur:
        ur.move(0.3)
        states, seen = Stream(ur.host), {}
        begin = CLOCK.now()
        while CLOCK.now() < begin + 1.2:
            state = states.state(CLOCK.now())
            if CLOCK.now() > begin + 0.6:  # the way's shortest time is known by then
                seen[state.stamp] = state.q[3]
            CLOCK.sleep_until(CLOCK.now() + 0.004)
        states.close()
    t, q = np.array(list(seen)), np.array(list(seen.values()))
    away = q - 0.3 * t
    assert len(t) > 50 and np.abs(away - np.median(away)).max() < 0.3 * 0.004


@pytest.mark.parametrize("kind", LINKS)
def test_no_trouble_of_the_link_holds_a_tick_up_and_states_come_again(monkeypatch, kind):
    monkeypatch.setattr(link, "PATIENCE", 0.5)
    monkeypatch.setattr(stream, "ROUND", 0.1)
    with VirtualUr() as ur:
        states, words, longest = Stream(ur.host), set(), 0.0
        ur.call("break_link", kind, 0.4)
        begin = CLOCK.now()
        while CLOCK.now() < begin + 5.0:
            called = CLOCK.now()
            states.state(called)
            states.report()
            lost = states.lost(called)
            longest = max(longest, CLOCK.now() - called)
            words.add(lost.split(" (")[0])
            if called > begin + 0.5 and not lost:
                break
            CLOCK.sleep_until(called + 0.004)
        states.close()
    assert not lost and longest < LONGEST
    named = {"drop": "connection is lost", "corrupt": "garbled", "silent": "connection is lost"}
    assert any(named.get(kind, "no joint state") in w for w in words)


def test_a_link_that_nobody_reads_is_read_all_the_same(monkeypatch):
    monkeypatch.setattr(stream, "ROUND", 0.05)
    with VirtualUr() as ur:
        states = Stream(ur.host)
        states.state(CLOCK.now())
        before = states._link.count
        CLOCK.sleep_until(CLOCK.now() + 0.3)  # as an engine that compiles
        assert states._link.count > before + 50
        states.close()
