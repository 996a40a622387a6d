"""The check of a real sensor, here of one behind a pseudo terminal that is shown a moving hand."""

import threading

import numpy as np
import pytest

from app.checks.skin_check import judge_hand, simulate
from app.checks.skin_port import record_port
from app.errors import SensorError
from app.sensing.wire import binary, lines
from app.timing import WallClock
from app.virtual.skin.pty_port import PtyPort
from tests.ports import raw

PART = 0.4  # [s] for each of the two moves


@pytest.fixture
def shown(robot, skin, tmp_path):
    """Start a board that says what sensor 15 sees of a hand, as `encode` says it."""
    depth = simulate(robot, skin, 15, "hand", 0)
    with PtyPort(tmp_path / "skin") as port:
        stop = threading.Event()
        threads = []

        def begin(encode):
            clock = WallClock()

            def speak():
                while not port.heard:
                    stop.wait(0.001)
                start = clock.now()
                for i, frame in enumerate(depth):
                    clock.sleep_until(start + 2.0 * PART * i / len(depth))
                    seen = np.isfinite(frame)
                    mm = np.where(seen, np.nan_to_num(frame) * 1e3, 947).round()
                    ago = round(2e6 * PART * i / len(depth))  # the clock of a board runs
                    port.write(encode(raw(15, i, ago, mm, np.where(seen, 5, 255))))

            threads.append(threading.Thread(target=speak))
            threads[-1].start()
            return port.link

        yield begin
        stop.set()
        for thread in threads:
            thread.join()


def test_a_hand_before_a_real_sensor_shows_that_its_zones_lie_right(shown, robot, skin):
    link, told = shown(binary.encode), []
    k, depth, _ = record_port(
        f"{link}=ring2-06", robot, skin, "hand", WallClock(), told.append, seconds=PART
    )  # fmt: skip
    assert k == 15 and judge_hand(depth, skin.sensors[k])["agrees"]
    assert told[0].startswith("move a hand once from left to right, as ring2-06 sees it")
    assert told[1].startswith("now once from top to bottom")


def test_mirrored_lines_read_as_plain_ones_are_found_out(shown, robot, skin):
    link = shown(lines.encode)
    text = f"{link}#lines-plain=ring2-06"
    _, depth, words = record_port(
        text, robot, skin, "hand", WallClock(), lambda _: None, seconds=PART
    )
    found = judge_hand(depth, skin.sensors[15])
    assert found["mirrored"] and not found["agrees"]
    assert "latency about 2" in words  # ms: half of 20, and 150 bytes at 115200 baud


def test_a_sensor_that_says_nothing_is_one_line(robot, skin, tmp_path):
    with PtyPort(tmp_path / "skin") as port:
        text = f"{port.link}=ring2-06"
        with pytest.raises(SensorError, match="ring2-06 has said nothing; its port is waiting"):
            record_port(text, robot, skin, "wall", WallClock(), lambda _: None, seconds=0.05)
    for text in ("/dev/a", "/dev/a=ring1", "auto=ring2-06", "/dev/a=ring1-01,/dev/b=ring1-02"):
        with pytest.raises(SensorError, match="name one port and one sensor"):
            record_port(text, robot, skin, "wall", WallClock(), lambda _: None)
