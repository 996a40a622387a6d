"""`flinch skin emulate`: a virtual skin on the same wire as a real one, at its full rate.

scene or recording ─► frames ─► faults of boards ─► bytes ─► faults of cables ─► pty
"""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from app.choices import build_robot, choose_home, lay_out
from app.errors import SensorError
from app.messages import SensorFrame, freeze
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.budget import read_budget
from app.sensing.captured import is_capture, read_capture
from app.sensing.port_spec import named_sensors
from app.sensing.replay import Recording, Replay, read_recording
from app.sensing.simulated import SimulatedSkin
from app.sensing.wire.detect import format_of
from app.sensing.wire.raw import NO_TARGET, Grid, RawFrame
from app.setup import Setup
from app.timing import Clock
from app.virtual.skin.faults import FaultyWire, parse_faults
from app.virtual.skin.pty_port import PtyPort
from app.virtual.skin.repeat import repeat
from app.virtual.skin.wearer import AtRest, Wearer, wearer
from app.world.scene import find_scene, load_scene
from app.world.world import World

TEMPERATURE = 30  # [degrees C] of a sensor that is nowhere


class FrameSource(Protocol):
    """Where a virtual board has its frames from."""

    def poll(self, now: float) -> Sequence[SensorFrame]: ...


@dataclass(frozen=True)
class Emulation:
    """What to emulate; `only` is a sensor or a ring, `replay` a recording instead of a scene, and
    `follow` the arm that the skin is mounted on."""

    link: Path
    format: str = "binary"
    replay: str = ""
    faults: str = ""
    only: str = ""
    seconds: float = 0.0  # 0: until it is asked to end
    follow: str = ""  # ur:HOST; empty: an arm that stands still

    @property
    def bytes(self) -> bool:
        """Is it a file of raw bytes that is spoken again?"""
        return bool(self.replay) and is_capture(Path(self.replay))

    def __post_init__(self) -> None:
        if self.replay and self.follow:
            raise SensorError("a recording saw what it saw; leave --replay or --follow out")
        if self.bytes and (self.faults or self.only):
            raise SensorError("recorded bytes are what they are; leave --faults and --only out")
        if not 0.0 <= self.seconds < 1e9:
            raise SensorError(f"seconds = {self.seconds:g}; give a positive number, or 0 for ever")


def emulate(
    what: Emulation,
    setup: Setup,
    clock: Clock,
    ready: Callable[[str], None],
    over: Callable[[], bool] = lambda: False,
) -> tuple[int, int]:
    """Speak until the time is up or `over`; returns packets said and packets lost.

    `ready` is called once with a sentence when the port can be opened.
    """
    robot = build_robot(setup)
    skin = lay_out(robot)
    style = format_of(what.format)
    sensors = named_sensors(what.only, skin) if what.only else tuple(range(skin.count))
    if not style.named:
        sensors = sensors[:1]  # such a format has room for one sensor
    faults = parse_faults(what.faults, partial(named_sensors, skin=skin))
    scene = load_scene(find_scene(setup.scene), setup.seed)
    home = choose_home(setup, scene, robot)
    rest = robot.home if home is None else home
    # it is the wire that tells this skin's times wrongly
    budget = replace(read_budget(setup.world), time=0.0, late_ms=0.0)
    frames: FrameSource
    arm: Wearer
    if what.bytes:
        with PtyPort(what.link) as port:
            ready(f"what is in {what.replay}, on {what.link}")
            return repeat(read_capture(Path(what.replay)), skin, port, clock, what.seconds, over)
    if what.replay:
        at_home = robot.posture(robot.home)
        arm = AtRest(robot, rest)
        frames = RecordedFrames(read_recording(Path(what.replay)), skin, sensors, at_home)
    else:
        world = World(scene.bodies)
        eye = SimulatedSkin(robot, skin, world, setup.seed, latency=0.0, budget=budget)
        arm = wearer(what.follow, eye.truth.robot, rest)
        eye.muted = set(range(skin.count)) - set(sensors)
        frames = SceneFrames(eye, world, arm)
    with closing(arm), PtyPort(what.link) as port:
        names = skin.sensors[sensors[0]].name
        if len(sensors) > 1:
            names += f" to {skin.sensors[sensors[-1]].name}"
        rate = max(skin.sensors[k].type.rate_hz for k in sensors)
        ready(f"{names} at {rate:g} Hz, format {what.format}, on {what.link}")
        transmitter = Transmitter(style.encode, FaultyWire(faults, clock.now(), setup.seed), port)
        period = 1.0 / (rate * len(sensors))
        return send_frames(frames, skin, transmitter, clock, period, what.seconds, over)


class Transmitter(NamedTuple):
    """What a frame goes through on its way out: its format, what goes wrong, and the port."""

    encode: Callable[[RawFrame], bytes]
    faulty: FaultyWire
    port: PtyPort


def send_frames(
    frames: FrameSource,
    skin: Skin,
    transmitter: Transmitter,
    clock: Clock,
    period: float,
    seconds: float = 0.0,
    over: Callable[[], bool] = lambda: False,
) -> tuple[int, int]:
    """Send every frame when it is due, looking for them every `period` [s], until the time is up
    (0: never) or `over`; returns packets sent and packets lost."""
    begin = due = clock.now()
    said = 0
    while not over() and (not seconds or clock.now() - begin < seconds):
        now = clock.now()
        for f in frames.poll(now):
            said += 1
            raw = raw_frame(f, skin.sensors[f.sensor].type.grid, transmitter.faulty.clock(now))
            packet = transmitter.encode(transmitter.faulty.frame(raw))
            transmitter.port.write(transmitter.faulty.wire(packet, now))
        due = max(due + period, now)  # after a stall no burst of old frames
        clock.sleep_until(due)
    return said, transmitter.port.lost


def raw_frame(frame: SensorFrame, grid: Grid, t_us: int) -> RawFrame:
    """A frame as its board would send it, rows and columns in `grid`; distances in whole mm."""
    distance = np.clip(np.round(frame.distance * 1e3), -32768, 32767).astype(np.int16)
    status = np.where(frame.targets > 0, frame.status, NO_TARGET).astype(np.uint8)
    return RawFrame(
        frame.sensor, frame.sequence % (1 << 16), t_us, grid, freeze(distance),
        freeze(status), TEMPERATURE,
    )  # fmt: skip


class SceneFrames:
    """Frames of a scene, seen by a skin on an arm."""

    def __init__(self, eye: SimulatedSkin, world: World, arm: Wearer) -> None:
        self._eye, self._world, self._arm = eye, world, arm
        self._begin: float | None = None

    def poll(self, now: float) -> Sequence[SensorFrame]:
        """Frames of the sensors that are due."""
        if self._begin is None:
            self._begin = now
        self._world.step(now - self._begin)
        return self._eye.poll(now, self._arm.posture(now))


class RecordedFrames:
    """A recording on every one of `sensors`, staggered over a period, again and again."""

    def __init__(
        self, recording: Recording, skin: Skin, sensors: Sequence[int], posture: Posture
    ) -> None:
        self._recording, self._skin, self._posture = recording, skin, posture
        self._players = {k: Replay(recording, skin, k) for k in sensors}
        self._sequence = dict.fromkeys(sensors, 0)
        self._begin: float | None = None

    def poll(self, now: float) -> Sequence[SensorFrame]:
        """Frames whose recorded time has come."""
        if self._begin is None:
            self._begin = now
        out = []
        for i, (k, player) in enumerate(self._players.items()):
            period = self._skin.sensors[k].type.period
            if now < self._begin + i * period / len(self._players):
                continue
            for f in player.poll(now, self._posture):
                out.append(
                    SensorFrame(k, f.stamp, self._sequence[k], f.distance, f.status, f.targets)
                )
                self._sequence[k] += 1
            if player.ended():
                self._players[k] = Replay(self._recording, self._skin, k)
        return out
