"""A whole skin over a real pseudo terminal: is anything lost, and how long is it under way?

Another process speaks 30 sensors x 15 Hz in the binary format. Every zone's distance follows
from the sensor and the sequence, so that a frame that is wrong or given to another sensor shows;
its clock is this machine's, so that the time from the last byte's writing to the cloud is
measured and not estimated. Frames that this machine itself leaves lying for longer than the skin
takes them are counted apart, as too old.
"""

import multiprocessing
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.actions import SetMode
from app.choices import build_robot, choose_skin
from app.errors import SensorError
from app.messages import Mode, SensorFrame
from app.rehearsal import rehearse
from app.report import Check, Report
from app.robot.arm import SimulatedArm
from app.robot.posture import Posture
from app.runtime import Engine
from app.sensing.port import Port
from app.sensing.port_spec import PortSpec
from app.sensing.serial_skin import SerialSkin
from app.sensing.stream import Arrival
from app.sensing.wire import binary
from app.sensing.wire.raw import VALID, RawFrame
from app.setup import Setup
from app.timing import WallClock
from app.virtual.skin.pty_port import PtyPort
from app.wiring import assemble

READER_LIMIT = 0.05  # of a core
LATENCY_LIMIT = 5.0  # [ms] 99 of 100 frames, from the wire to the cloud
SETTLE = 1.0  # [s] after the start that is not timed: caches fill, the clock is found
START = 60.0  # [s] for the other process to come up
DRAIN = 0.3  # [s] after the last frame was said
WRAP = 1 << 32  # [us]
RATE = 15.0  # [Hz] of every sensor
GRID = (8, 8)
STATUS = np.full(GRID[0] * GRID[1], VALID, dtype=np.uint8)


def bench_serial(setup: Setup, seconds: float) -> Report:
    """Run the engine on the skin for `seconds` and count."""
    robot = build_robot(setup)
    skin = choose_skin(setup, robot)
    clock = WallClock()
    ours, theirs = multiprocessing.Pipe()
    with TemporaryDirectory() as folder:
        link = Path(folder) / "skin"
        board = multiprocessing.get_context("spawn").Process(
            target=send_patterns, args=(link, skin.count, seconds, theirs), daemon=True
        )
        board.start()
        if not ours.poll(START):
            raise SensorError("the board's process does not start; try again on a quieter machine")
        ours.recv()
        spec = PortSpec(str(link))
        port = AuditedPort(spec, clock)
        source = AuditedSkin(skin, [port], [spec])
        arm = SimulatedArm(robot)
        engine = assemble(robot, skin, arm, source, None, clock, rate=setup.rate)
        rehearse(robot, skin, engine.cell, engine.brain.params)
        engine.post(SetMode(Mode.RUNNING))
        times = Times()
        begin, busy = clock.now(), port.facts().busy
        ours.send("go")
        while not ours.poll():
            times.tick(engine, port)
            if not board.is_alive():
                raise SensorError("the board's process has died; try again")
        said, drowned = ours.recv()
        end = clock.now() + DRAIN
        while clock.now() < end or port.fresh:
            times.tick(engine, port)
        elapsed, facts = clock.now() - begin, port.facts()
        engine.close()
        ours.send("bye")
        board.join()
    share = (facts.busy - busy) / elapsed
    late = np.array(engine.ticker.lateness)
    counts = {
        "said": said, "taken": port.taken, "wrong": port.wrong + source.wrong,
        "damaged": facts.damaged, "drowned": drowned, "too old": port.taken - source.taken,
        "seconds": elapsed,
    }  # fmt: skip
    return _report(setup, counts, share, facts.drift, times.rows, late)


class AuditedPort(Port):
    """A port that keeps what was taken from it, to be timed, and counts what is wrong in it."""

    fresh: list[Arrival]
    taken = wrong = 0

    def receive(self) -> list[Arrival]:
        """As the port's."""
        self.fresh = super().receive()
        for a in self.fresh:
            said = pattern(a.frame.sensor or 0, a.frame.sequence or 0)
            self.wrong += not np.array_equal(a.frame.distance, said)
        self.taken += len(self.fresh)
        return self.fresh


class AuditedSkin(SerialSkin):
    """A skin whose frames are held against their sensors, again: wrong ones are counted."""

    taken = wrong = 0

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """As the skin's."""
        frames = super().poll(now, posture)
        for f in frames:
            said = pattern(f.sensor, f.sequence)
            self.wrong += not np.array_equal(np.round(f.distance * 1e3), said)
        self.taken += len(frames)
        return frames


class Times:
    """When frames were said, arrived and were in the cloud [s], and what they were stamped."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float, float, float]] = []

    def tick(self, engine: Engine, port: AuditedPort) -> None:
        """One tick of the engine, whose frames are timed."""
        rooms = (snapshot := engine.step()).timing.rooms
        cloud = snapshot.stamp + rooms["simulate"] + rooms["kinematics"] + rooms["filter"]
        for a in port.fresh:
            late = (round(a.arrived * 1e6) - (a.frame.t_us or 0)) % WRAP * 1e-6
            self.rows.append((a.arrived - late, a.stamp, a.arrived, cloud))


def send_patterns(link: Path, count: int, seconds: float, pipe: Connection) -> None:
    """The board: says every sensor's frames in turn, stamped with this machine's clock."""
    clock = WallClock()
    with PtyPort(link) as port:
        pipe.send("here")
        pipe.recv()
        begin = clock.now()
        said = 0
        while said < seconds * RATE * count:
            due = begin + said / (RATE * count)
            clock.sleep_until(due)
            k, n = said % count, (said // count) % (1 << 16)
            t_us = round(clock.now() * 1e6) % WRAP
            port.write(binary.encode(RawFrame(k, n, t_us, GRID, pattern(k, n), STATUS)))
            said += 1
        pipe.send((said, port.lost))
        pipe.recv()


def pattern(sensor: int, sequence: int) -> NDArray[np.int16]:
    """Distances (n,) [mm] that only this frame of this sensor has."""
    zone = np.arange(len(STATUS))
    return (600 + (37 * sensor + 101 * sequence + 13 * zone) % 1009).astype(np.int16)


def _report(
    setup: Setup,
    counts: dict[str, float],
    share: float,
    drift: float,
    rows: Sequence[tuple[float, float, float, float]],
    late: NDArray[np.float64],
) -> Report:
    at = np.array(rows)
    at = at[at[:, 0] > at[0, 0] + SETTLE]
    sent, stamp, arrived, cloud = at.T
    table: list[dict[str, Any]] = [
        {"name": "frames"} | counts,
        _row("wire to host", arrived - sent),
        _row("wire to cloud", cloud - sent),
        _row("error of the stamp", stamp - sent),
        _row("lateness of the ticks", late),  # the machine's share in the above
        {"name": "reader", "share of a core": share, "drift_ppm": 1e6 * drift},
    ]
    p99 = 1e3 * float(np.percentile(cloud - sent, 99))
    checks = [
        Check("frames lost", counts["said"] - counts["taken"], "", 0.0),
        Check("frames wrong or misassigned", counts["wrong"], "", 0.0),
        Check("reader, share of a core", share, "", READER_LIMIT),
        Check("wire to cloud, p99", p99, "ms", LATENCY_LIMIT),
    ]
    return Report("bench serial", setup.seed, table, checks)


def _row(name: str, seconds: NDArray[np.float64]) -> dict[str, Any]:
    p50, p95, p99, most = 1e3 * np.percentile(seconds, [50, 95, 99, 100])
    return {"name": name, "p50_ms": p50, "p95_ms": p95, "p99_ms": p99, "max_ms": most}
