"""A port's reader thread on real pseudo terminals: bytes in, plugs pulled, speeds tried."""

import os
import pty
import time
import tty

import numpy as np
import pytest

from app.errors import SensorError
from app.sensing.open_ports import open_skin
from app.sensing.port import Port
from app.sensing.port_spec import PortSpec
from app.sensing.wire import binary, f_line
from app.timing import WallClock
from app.virtual.skin.pty_port import PtyPort
from tests.ports import raw

PATIENCE = 5.0  # [s] for what should come at once


def wait_for(condition):
    """Until it holds; the reader is a thread of its own."""
    end = time.perf_counter() + PATIENCE
    while not condition():
        assert time.perf_counter() < end, "waited in vain"
        time.sleep(0.002)


def taken(port, count):
    """The next `count` arrivals."""
    got = []
    wait_for(lambda: got.extend(port.receive()) or len(got) >= count)
    return got


@pytest.fixture
def line():
    """Both ends of a pseudo terminal, as a bare kernel gives them."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    os.close(slave)
    os.close(master)


def test_frames_written_to_a_terminal_arrive_stamped(line):
    master, name = line
    port = Port(PortSpec(name), WallClock())
    try:
        before = time.perf_counter()
        for i in range(20):
            os.write(master, binary.encode(raw(i, 5, 1000 * i, 100 + i)))
        got = taken(port, 20)
        assert [a.frame.sensor for a in got] == list(range(20))
        assert all(before < a.stamp <= a.arrived < time.perf_counter() for a in got)
        assert port.facts().format == "binary" and port.facts().damaged == 0
    finally:
        port.close()


def test_nothing_is_lost_of_a_burst_that_comes_in_crumbs(line):
    master, name = line
    port = Port(PortSpec(name, format="binary"), WallClock())
    rng = np.random.default_rng(0)
    try:
        stream = b"".join(binary.encode(raw(i % 30, i // 30)) for i in range(90))
        while stream:
            n = int(rng.integers(1, 700))
            os.write(master, stream[:n])
            stream = stream[n:]
        assert len(taken(port, 90)) == 90
        assert port.facts().lost == 0 and port.facts().damaged == 0
    finally:
        port.close()


def test_a_port_that_is_unplugged_and_plugged_again_goes_on_by_itself(tmp_path):
    link = tmp_path / "skin"
    with PtyPort(link) as board:
        port = Port(PortSpec(str(link)), WallClock())
        wait_for(lambda: board.heard)
        board.write(binary.encode(raw(3)))
        taken(port, 1)
    try:
        wait_for(lambda: not port.facts().open)
        assert port.facts().error == "unplugged or switched off"
        with PtyPort(link) as board:
            wait_for(lambda: port.facts().open)
            assert port.facts().format == ""  # another board may hang on it now
            board.write(b"\n" + f_line.encode(raw(distance=700)))
            (arrival,) = taken(port, 1)
            assert port.facts().format == "f" and (arrival.frame.distance == 700).all()
    finally:
        port.close()


def test_a_port_tries_other_speeds_while_it_hears_nothing_it_knows(tmp_path, monkeypatch):
    import serial

    from app.sensing import port as module

    monkeypatch.setattr(module, "TRIAL", 0.02)
    speeds = []
    real = serial.Serial.baudrate
    monkeypatch.setattr(
        serial.Serial,
        "baudrate",
        property(real.fget, lambda s, b: (speeds.append(b), real.fset(s, b))[1]),
    )
    with PtyPort(tmp_path / "skin") as board:
        port = Port(PortSpec(str(board.link)), WallClock())
        try:
            wait_for(lambda: port.receive() or board.write(b"\x55junk") or len(set(speeds)) == 4)
            board.write(b"\0" + binary.encode(raw(1)))
            taken(port, 1)
            assert set(speeds) == {2_000_000, 921_600, 460_800, 115_200}
        finally:
            port.close()


def test_a_port_that_cannot_be_opened_is_one_line(tmp_path, skin):
    with pytest.raises(SensorError, match=r"none cannot be opened \(No such file") as error:
        open_skin(str(tmp_path / "none"), skin, WallClock())
    assert "\n" not in str(error.value)


def test_a_port_that_another_program_reads_is_refused(tmp_path, skin):
    with PtyPort(tmp_path / "skin") as board:
        port = Port(PortSpec(str(board.link)), WallClock())
        try:
            with pytest.raises(SensorError, match="another program uses it"):
                open_skin(f"{board.link}", skin, WallClock())
        finally:
            port.close()


def test_a_reader_that_dies_is_a_lost_port_with_its_reason(line, monkeypatch):
    from app.sensing import line as module

    def broken(*_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(module, "_hung_up", broken)
    port = Port(PortSpec(line[1]), WallClock())
    wait_for(lambda: not port.facts().open)
    assert "its reader has died" in port.facts().error and "a bug" in port.facts().error
    port.close()


def test_auto_keeps_the_ports_that_speak(tmp_path, skin, monkeypatch):
    from app.sensing import open_ports

    monkeypatch.setattr(open_ports, "LISTEN", 1.0)
    with PtyPort(tmp_path / "a") as a, PtyPort(tmp_path / "b") as b:
        names = [str(a.link), str(b.link), str(tmp_path / "none")]

        def candidates():
            return names

        class Talking(WallClock):
            """Lets boards speak while the search sleeps."""

            boards = (a,)

            def sleep_until(self, t):
                for board in self.boards:
                    board.write(binary.encode(raw(4)))
                super().sleep_until(t)

        source = open_skin("auto", skin, Talking(), candidates)
        try:
            assert source.name == f"serial {a.link}"
        finally:
            source.close()
        Talking.boards = (a, b)
        with pytest.raises(SensorError, match=r"a, .*b speak, and serial:auto=SENSORS is for one"):
            open_skin("auto=ring1", skin, Talking(), candidates)
        with pytest.raises(SensorError, match=r"no skin found .* none of .* speaks"):
            open_skin("auto", skin, WallClock(), lambda: [str(b.link)])
    with pytest.raises(SensorError, match=r"no skin found .*: there is none; name one"):
        open_skin("auto", skin, WallClock(), lambda: [])


def test_what_nobody_listens_to_is_lost_and_not_kept(tmp_path):
    with PtyPort(tmp_path / "skin") as board:
        for i in range(100):
            board.write(binary.encode(raw(0, i)))
        port = Port(PortSpec(str(board.link)), WallClock())
        try:
            wait_for(lambda: board.heard)
            board.write(binary.encode(raw(0, 100)))
            assert [a.frame.sequence for a in taken(port, 1)] == [100]
        finally:
            port.close()
    assert not (tmp_path / "skin").is_symlink()


def test_a_link_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(SensorError, match=r"file: cannot be made a link \(File exists\)"):
        PtyPort(tmp_path / "file")
    assert (tmp_path / "file").read_text() == "mine"
