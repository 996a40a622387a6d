"""`flinch calibrate-filter`: thresholds for the self filter from returns of the robot itself."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.config import Params
from app.errors import SensorError
from app.messages import Array, SensorFrame
from app.perception.calibration import BINS, suggest
from app.perception.cloud import corrected
from app.perception.self_filter import SelfFilter
from app.report import Report
from app.robot.model import Robot, find_robot, load_robot
from app.robot.posture import Posture
from app.robot.ranges import complete, load_ranges
from app.robot.skin import Skin, load_skin
from app.sensing.replay import read_recording
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

AROUND = float(BINS[-1])  # [m] of the body: what is farther from it is something else
POSTURES = 100  # of a simulated calibration
Samples = tuple[list[Array], list[Array], list[Array], list[Array]]  # link, gap, noise, edge


def calibrate(
    robot_name: str,
    recording: str,
    skin_file: str = "",
    seed: int = 0,
    ranges: Path | None = None,
) -> Report:
    """Thresholds of every link that the sensors see.

    recording: 'simulated', or PATH[@SENSOR] of an arm at rest at home with nothing near.
    ranges:    table of the zones' errors, taken off first.
    """
    robot = load_robot(find_robot(robot_name))
    file = skin_file or robot.skin
    if not file:
        raise SensorError(f"{robot.name} names no skin of its own; choose one with --skin")
    skin = load_skin(Path(file) if skin_file else robot.folder / file, robot)
    if ranges is not None:
        skin = replace(skin, ranges=complete(load_ranges(ranges, skin.slots)))
    params = Params()
    samples = (
        _simulated(robot, skin, params, seed)
        if recording == "simulated"
        else _recorded(robot, skin, params, recording)
    )
    link, gap, noise, edge = (np.concatenate(s) if s else np.empty(0) for s in samples)
    near = np.abs(gap) <= AROUND
    if not near.any():
        raise SensorError(
            f"{recording}: no zone sees the robot at home; record an arm whose sensors see it"
        )
    found = suggest(
        robot.links, link[near].astype(np.int16), gap[near], noise[near], edge[near].astype(bool),
    )  # fmt: skip
    rows: list[dict[str, Any]] = [
        {
            "name": s.link, "returns": s.returns, "eps_m": s.eps, "eps_edge_m": s.edge,
            "histogram_from_m": float(BINS[0]), "histogram_step_m": float(BINS[1] - BINS[0]),
            "histogram": s.histogram.tolist(), "shape": bars(s.histogram),
        }
        for s in found
    ]  # fmt: skip
    for key in ("eps", "edge"):
        known = {s.link: getattr(s, key) for s in found if np.isfinite(getattr(s, key))}
        if known:
            values = ", ".join(f"{name} = {eps:.4f}" for name, eps in known.items())
            field = "eps_m" if key == "eps" else "eps_edge_m"
            rows.append({"name": "for robot.toml", "line": f"{field} = {{ {values} }}"})
    return Report("calibrate-filter", seed, rows)


def bars(histogram: Any) -> str:
    """A histogram as a line of text."""
    steps = " .:-=+*#%@"
    top = max(1, int(histogram.max()))
    return "|" + "".join(steps[int(np.ceil(9 * n / top))] for n in histogram) + "|"


def _simulated(robot: Robot, skin: Skin, params: Params, seed: int) -> Samples:
    eye = SimulatedSkin(robot, skin, World(()), seed, latency=0.0)
    rng, period = np.random.default_rng(seed), max(s.type.period for s in skin.sensors)
    judge, out = SelfFilter(robot, skin), ([], [], [], [])  # type: tuple[SelfFilter, Samples]
    for i in range(POSTURES):
        posture = robot.posture(robot.home + rng.uniform(-1.5, 1.5, robot.n))
        for j in range(skin.count):  # one whole round of the staggered sensors
            for f in eye.poll((i + j / skin.count) * period, posture):
                _judge(judge, skin, f, posture, params, out)
    return out


def _recorded(robot: Robot, skin: Skin, params: Params, recording: str) -> Samples:
    path, _, name = recording.partition("@")
    r, k = read_recording(Path(path)), skin.index(name) if name else 0
    judge, out = SelfFilter(robot, skin), ([], [], [], [])  # type: tuple[SelfFilter, Samples]
    posture = robot.posture(robot.home)
    for i, frame in enumerate(zip(r.distance, r.status, r.targets, strict=True)):
        _judge(judge, skin, SensorFrame(k, r.stamp[i], i, *frame), posture, params, out)
    return out


def _judge(
    judge: SelfFilter, skin: Skin, frame: SensorFrame, posture: Posture, params: Params,
    out: Samples,
) -> None:  # fmt: skip
    k, mine = frame.sensor, skin.zones(frame.sensor)
    reported = np.zeros(skin.slots)
    reported[mine] = corrected(skin, np.arange(skin.slots)[mine], frame.distance)
    seen = judge.judge(np.array([k]), reported, posture, params)
    good = np.isfinite(skin.believed(k, frame.distance, frame.status, frame.targets))
    good &= seen.link[mine] >= 0
    noise = skin.sensors[k].type.noise(reported[mine])
    found: tuple[Any, ...] = (seen.link[mine], seen.gap[mine], noise, seen.edge[mine])
    for store, values in zip(out, found, strict=True):
        store.append(values[good])
