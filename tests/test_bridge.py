"""A skin behind a serial bridge: a TCP socket, or one that speaks RFC 2217."""

import contextlib
import socket
import threading
import time
from itertools import pairwise

import pytest
import serial.rfc2217

from app.errors import SensorError
from app.sensing.port import Port
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.wire import binary
from app.timing import WallClock
from tests.ports import raw
from tests.test_port import taken


@pytest.fixture
def listener():
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(5.0)
        yield server


def spec(server, scheme="socket"):
    return PortSpec(f"{scheme}://127.0.0.1:{server.getsockname()[1]}", format="binary")


def test_frames_come_through_a_socket_and_after_it_was_cut_again(listener):
    port = Port(spec(listener), WallClock())
    try:
        for sensor in (3, 4):  # it looks for the bridge again by itself
            bridge, _ = listener.accept()
            with bridge:
                got, sent = [], 0
                while len(got) < 5:  # what comes while it is being opened is left out
                    bridge.sendall(binary.encode(raw(sensor, sent, 1000 * sent)))
                    sent += 1
                    got += [a for a in port.receive() if a.frame.sensor == sensor]
                    assert sent < 5000
                    time.sleep(0.001)  # the reader is a thread of its own
                steps = {b.frame.sequence - a.frame.sequence for a, b in pairwise(got)}
                assert steps == {1}
                assert port.facts().open
    finally:
        port.close()


@pytest.mark.filterwarnings("ignore:set.* is deprecated:DeprecationWarning")  # pyserial's
def test_frames_come_through_a_bridge_that_speaks_rfc_2217(listener):
    done = threading.Event()

    class Telnet(threading.Thread):
        """The other end: agrees with all that is asked for, then speaks."""

        def run(self):
            end, _ = listener.accept()
            with end:
                pretended = serial.serial_for_url("loop://", timeout=0)
                manager = serial.rfc2217.PortManager(pretended, Writer(end))
                end.settimeout(0.05)
                begin = time.perf_counter()
                sent = 0
                while not done.is_set() and time.perf_counter() - begin < 20.0:
                    with contextlib.suppress(OSError):
                        b"".join(manager.filter(end.recv(1024)))
                    if time.perf_counter() - begin > 0.3:
                        packet = binary.encode(raw(3, sent, 1000 * sent))
                        with contextlib.suppress(OSError):  # the reader has had enough
                            end.sendall(b"".join(manager.escape(packet)))
                        sent += 1

    class Writer:
        def __init__(self, end):
            self.write = end.sendall

    other = Telnet(daemon=True)
    other.start()
    port = Port(spec(listener, "rfc2217"), WallClock())
    try:
        assert [a.frame.sensor for a in taken(port, 3)[:3]] == [3, 3, 3]
    finally:
        done.set()
        port.close()
        other.join(5.0)


def test_nobody_at_the_address_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as server:
        free = spec(server)
    with pytest.raises(SensorError, match="cannot be opened") as e:
        Port(free, WallClock())
    assert "\n" not in str(e.value)


@pytest.mark.parametrize("address", ["loop://", "spy:///dev/ttyACM0", "hwgrep://ACM", "http://a:1"])
def test_other_addresses_are_refused_at_the_start(skin, address):
    with pytest.raises(SensorError, match="socket://HOST:PORT or rfc2217"):
        parse_ports(f"{address}=ring2-03", skin)


def test_an_address_of_a_bridge_is_understood_with_all_that_may_follow(skin):
    (one,) = parse_ports("socket://10.0.0.7:7777#sparkfun=ring2-03:latency_ms=20", skin)
    assert (one.port, one.format, one.latency) == ("socket://10.0.0.7:7777", "sparkfun", 0.02)
    (one,) = parse_ports("rfc2217://[::1]:4000@115200#sparkfun=ring2-03", skin)
    assert (one.port, one.baud) == ("rfc2217://[::1]:4000", 115200)
