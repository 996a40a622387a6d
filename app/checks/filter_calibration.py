"""`flinch calibrate filter`: thresholds for the self filter from returns of the robot itself."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot_and_skin, lay_out
from app.errors import SensorError
from app.messages import SensorFrame
from app.perception.calibration import BINS, suggest
from app.perception.cloud import corrected
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.report import Report
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.budget import read_budget
from app.sensing.replays import recorded
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.world.world import World

AROUND = float(BINS[-1])  # [m] of the body: what is farther from it is something else
POSTURES = 100  # of a simulated calibration


class Samples:
    """What a skin's zones saw of the robot itself: link, gap and noise [m], across an edge."""

    def __init__(self, robot: Robot, skin: Skin, rules: Rules) -> None:
        self._skin, self._rules, self._filter = skin, rules, SelfFilter(robot, skin)
        self._parts: list[tuple[NDArray[Any], ...]] = [(np.empty(0),) * 4]

    def add(self, frame: SensorFrame, posture: Posture) -> None:
        """The trusted zones of a frame in whose way the robot lies."""
        skin, k, mine = self._skin, frame.sensor, self._skin.zones(frame.sensor)
        reported = np.zeros(skin.slots)
        reported[mine] = corrected(skin, np.arange(skin.slots)[mine], frame.distance)
        seen = self._filter.judge(np.array([k]), reported, posture, self._rules)
        good = np.isfinite(skin.believed(k, frame.distance, frame.status, frame.targets))
        good &= seen.link[mine] >= 0
        noise = skin.sensors[k].type.noise(reported[mine])
        columns = (seen.link[mine], seen.gap[mine], noise, seen.edge[mine])
        self._parts.append(tuple(column[good] for column in columns))

    def near(self, away: float) -> tuple[NDArray[Any], ...]:
        """The columns (n,) of all zones that saw something within `away` [m] of the body."""
        columns = [np.concatenate(column) for column in zip(*self._parts, strict=True)]
        use = np.abs(columns[1]) <= away
        return tuple(column[use] for column in columns)


def calibrate(setup: Setup, recording: str) -> Report:
    """Thresholds of every link that the sensors see.

    setup:     the robot, its skin, the seed, and the table of the zones' errors, taken off first.
    recording: 'simulated', or PATH[@SENSOR] of an arm at rest at home with nothing near.
    """
    robot, skin = build_robot_and_skin(setup)
    rules = Rules()
    samples = Samples(robot, skin, rules)
    if recording == "simulated":
        _simulate(samples, robot, setup)
    else:
        _replay(samples, robot, skin, recording)
    link, gap, noise, edge = samples.near(AROUND)
    if not len(gap):
        raise SensorError(
            f"{recording}: no zone sees the robot at home; record an arm whose sensors see it"
        )
    found = suggest(robot.links, link.astype(np.int16), gap, noise, edge.astype(bool))
    rows: list[dict[str, Any]] = [
        {
            "name": s.link, "returns": s.returns, "eps_m": s.eps, "eps_edge_m": s.edge,
            "histogram_from_m": float(BINS[0]), "histogram_step_m": float(BINS[1] - BINS[0]),
            "histogram": s.histogram.tolist(), "shape": histogram_text(s.histogram),
        }
        for s in found
    ]  # fmt: skip
    for key in ("eps", "edge"):
        known = {s.link: getattr(s, key) for s in found if np.isfinite(getattr(s, key))}
        if known:
            values = ", ".join(f"{name} = {eps:.4f}" for name, eps in known.items())
            field = "eps_m" if key == "eps" else "eps_edge_m"
            rows.append({"name": "for robot.toml", "line": f"{field} = {{ {values} }}"})
    return Report("calibrate filter", setup.seed, rows)


def histogram_text(histogram: Any) -> str:
    """A histogram as a line of text."""
    steps = " .:-=+*#%@"
    top = max(1, int(histogram.max()))
    return "|" + "".join(steps[int(np.ceil(9 * n / top))] for n in histogram) + "|"


def _simulate(samples: Samples, robot: Robot, setup: Setup) -> None:
    """The arm alone, in postures around home; it is seen where it is, and judged as believed."""
    skin, budget = lay_out(robot), read_budget(setup.world)
    eye = SimulatedSkin(robot, skin, World(()), setup.seed, latency=0.0, budget=budget)
    rng, period = np.random.default_rng(setup.seed), max(s.type.period for s in skin.sensors)
    for i in range(POSTURES):
        posture = robot.posture(robot.home + rng.uniform(-1.5, 1.5, robot.n))
        there = eye.truth.robot.posture(posture.q)
        for j in range(skin.count):  # one whole round of the staggered sensors
            for frame in eye.poll((i + j / skin.count) * period, there):
                samples.add(frame, posture)


def _replay(samples: Samples, robot: Robot, skin: Skin, recording: str) -> None:
    """A recording, PATH[@SENSOR], of the arm at home."""
    posture = robot.posture(robot.home)
    k, *reports = recorded(recording, skin, posture)
    for i, columns in enumerate(zip(*reports, strict=True)):
        samples.add(SensorFrame(k, 0.0, i, *columns), posture)
