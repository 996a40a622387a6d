"""A whole skin on a pseudo terminal, spoken by a process of its own: what a real one costs us.

It says a second of frames of a scene, seen from an arm at rest, again and again: made
beforehand, so that the board takes nothing from the machine that is measured.
"""

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory

from app.choices import build_robot_and_skin
from app.errors import SensorError
from app.sensing.simulated import SimulatedSkin
from app.sensing.wire import binary
from app.sensing.wire.raw import RawFrame
from app.setup import Setup
from app.timing import WallClock
from app.virtual.skin.emulate import SceneFrames, raw_frame
from app.virtual.skin.pty_port import PtyPort
from app.virtual.skin.wearer import AtRest
from app.world.scene import find_scene, load_scene
from app.world.world import World

START = 60.0  # [s] for the process to come up
LOOP = 1.0  # [s] of frames that are said again and again


@contextmanager
def speaking_board(robot: str, scene: str, seed: int) -> Iterator[Path]:
    """The port of a board that speaks for every sensor of a robot's own skin, until the end."""
    ours, theirs = multiprocessing.Pipe()
    with TemporaryDirectory() as folder:
        link = Path(folder) / "skin"
        process = multiprocessing.get_context("spawn").Process(
            target=_send_frames, args=(link, robot, scene, seed, theirs), daemon=True
        )
        process.start()
        theirs.close()  # or its end would not be noticed here
        try:
            if not ours.poll(START) or not _here(ours):
                raise SensorError("the board's process does not start; see above")
            yield link
        finally:
            ours.close()
            process.join()


def _here(pipe: Connection) -> bool:
    try:
        return bool(pipe.recv())
    except EOFError:
        return False


def _send_frames(link: Path, robot_name: str, scene: str, seed: int, pipe: Connection) -> None:
    frames, rate = _frames(robot_name, scene, seed)
    clock = WallClock()
    with PtyPort(link) as port:
        pipe.send("here")
        begin, said = clock.now(), 0
        while not pipe.poll():
            clock.sleep_until(begin + said * LOOP / len(frames))
            raw, turn = frames[said % len(frames)], said // len(frames)
            sequence = ((raw.sequence or 0) + turn * round(rate * LOOP)) % (1 << 16)
            t_us = round(clock.now() * 1e6) % (1 << 32)
            port.write(binary.encode(replace(raw, sequence=sequence, t_us=t_us)))
            said += 1


def _frames(robot_name: str, scene_name: str, seed: int) -> tuple[list[RawFrame], float]:
    """What all sensors say in a turn, and how often [Hz] the fastest of them does."""
    robot, skin = build_robot_and_skin(Setup(robot=robot_name))
    scene = load_scene(find_scene(scene_name), seed)
    home = robot.home if scene.home is None else scene.home
    world = World(scene.bodies)
    eye = SimulatedSkin(robot, skin, world, seed, latency=0.0)
    rate = max(s.type.rate_hz for s in skin.sensors)
    seen, period = SceneFrames(eye, world, AtRest(robot, home)), 1.0 / (rate * skin.count)
    frames = [
        raw_frame(f, skin.sensors[f.sensor].type.grid, 0)
        for i in range(round(LOOP / period))
        for f in seen.poll(i * period)
    ]
    return frames, rate
