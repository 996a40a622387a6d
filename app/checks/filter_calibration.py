"""`flinch calibrate-filter`: thresholds for the self filter from returns of the robot itself."""

from pathlib import Path
from typing import Any

import numpy as np

from app.checks.skin import TRUSTED
from app.config import Params
from app.errors import SensorError
from app.messages import Array
from app.perception.calibration import BINS, suggest
from app.perception.self_filter import SelfFilter
from app.report import Report
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.replay import read_recording
from app.sensing.schedule import RATE
from app.sensing.simulated import SimulatedSkin
from app.wiring import Setup, build_robot, choose_skin
from app.world.world import World

AROUND = float(BINS[-1])  # [m] of the body: what is farther from it is something else
POSTURES = 100  # of a simulated calibration
Samples = tuple[list[Array], list[Array], list[Array], list[Array]]  # link, gap, depth, edge


def calibrate(setup: Setup, recording: str) -> Report:
    """Thresholds of every link that the sensors see.

    setup:     the robot, its skin, the seed, and the table of the zones' errors, taken off first.
    recording: 'simulated', or PATH[@SENSOR] of an arm at rest at home with nothing near.
    """
    robot = build_robot(setup)
    skin = choose_skin(setup, robot)
    params = Params()
    samples = (
        _simulated(robot, skin, params, setup.seed)
        if recording == "simulated"
        else _recorded(robot, skin, params, recording)
    )
    link, gap, depth, edge = (np.concatenate(s) if s else np.empty(0) for s in samples)
    near = np.abs(gap) <= AROUND
    if not near.any():
        raise SensorError(
            f"{recording}: no zone sees the robot at home; record an arm whose sensors see it"
        )
    found = suggest(
        robot.links, link[near].astype(np.int16), gap[near], depth[near],
        edge[near].astype(bool), params.eps_sigmas,
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
    return Report("calibrate-filter", setup.seed, rows)


def bars(histogram: Any) -> str:
    """A histogram as a line of text."""
    steps = " .:-=+*#%@"
    top = max(1, int(histogram.max()))
    return "|" + "".join(steps[int(np.ceil(9 * n / top))] for n in histogram) + "|"


def _simulated(robot: Robot, skin: Skin, params: Params, seed: int) -> Samples:
    eye = SimulatedSkin(robot, skin, World(()), seed, latency=0.0)
    rng = np.random.default_rng(seed)
    judge, out = SelfFilter(robot, skin), ([], [], [], [])  # type: tuple[SelfFilter, Samples]
    for i in range(POSTURES):
        posture = robot.posture(robot.home + rng.uniform(-1.5, 1.5, robot.n))
        for j in range(skin.count):  # one whole round of the staggered sensors
            for f in eye.poll((i + j / skin.count) / RATE, posture):
                _judge(judge, skin, f.sensor, f.distance, f.status, f.targets, posture, params, out)
    return out


def _recorded(robot: Robot, skin: Skin, params: Params, recording: str) -> Samples:
    path, _, name = recording.partition("@")
    r, k = read_recording(Path(path)), skin.index(name) if name else 0
    judge, out = SelfFilter(robot, skin), ([], [], [], [])  # type: tuple[SelfFilter, Samples]
    posture = robot.posture(robot.home)
    for distance, status, targets in zip(r.distance, r.status, r.targets, strict=True):
        _judge(judge, skin, k, distance, status, targets, posture, params, out)
    return out


def _judge(
    judge: SelfFilter, skin: Skin, k: int, distance: Array, status: Any, targets: Any,
    posture: Any, params: Params, out: Samples,
) -> None:  # fmt: skip
    if skin.ranges is not None:
        distance = skin.ranges.corrected(np.array([k]), distance[None])[0]
    seen = judge.judge(np.array([k]), distance[None], posture, params)
    good = (targets > 0) & np.isin(status, TRUSTED) & (seen.link[0] >= 0)
    for store, values in zip(out, (seen.link[0], seen.gap[0], distance, seen.edge[0]), strict=True):
        store.append(values[good])
