"""The self filter's verdicts beside the simulator's labels: what is lost, what passes.

Noise limits what any filter can do: whoever removes 99.9 % of the self returns must put the
threshold 3.1 sigmas before the body, and loses what noise carries beyond it. That bound is
printed beside the filter's figures. The simulator gives the true depths and the labels alone,
by rays and a zone's response that are not the filter's; what is reported of them is the judge's
(`app.judge.zone_errors`).
"""

from dataclasses import replace
from math import erf, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.bench.spheres import world_of_spheres
from app.checks.range_calibration import DISTANCES, FRAMES, table_of
from app.judge.zone_errors import ZoneErrors, deviation
from app.messages import Array, Verdict
from app.perception.calibration import suggest
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.report import Check
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.ranges import RangeTable, complete
from app.robot.skin import Skin
from app.sensing.budget import IDEAL
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

BEFORE = (0.01, 0.02, 0.05, 0.10)  # [m] of obstacles before the body
POSTURES = 150  # calibrated with, and as many to judge
SIGMAS = 3.0902  # of a normal distribution: 0.1 % lie beyond
ZONES = replace(IDEAL, zones=1.0)  # where the sensors are is known; what a zone does is not
NEAREST = 0.05  # [m] returns from nearer than this are not judged


class Sample(NamedTuple):
    """One posture with the true report (S,) [m] of every zone, and what it saw there."""

    posture: Posture
    depth: Array
    label: NDArray[np.int16]


def confusion(robot: Robot, skin: Skin, seed: int) -> tuple[list[dict[str, Any]], list[Check]]:
    """Shares kept with the default thresholds and with calibrated ones, noise on."""
    rng = np.random.default_rng(seed)
    noise = ZoneErrors(skin.slots, rng)
    ranges = _calibrated_ranges(noise, skin)
    samples = _samples(robot, skin, rng, seed)
    # calibration sees the first half of the postures, the figures come from the second
    first, second = samples[:POSTURES], samples[POSTURES:]
    default = SelfFilter(robot, skin)
    eps = _calibrated_eps(robot, skin, default, ranges, noise, first)
    calibrated = SelfFilter(replace(robot, eps=eps), skin)
    rows: list[dict[str, Any]] = []
    for name, judge, table in (("default", default, None), ("calibrated", calibrated, ranges)):
        shares = _shares(skin, judge, table, noise, second)
        rows.append({"name": f"kept, {name} thresholds"} | shares)
    bound = {f"{100 * b:g} cm": _bound(second, b) for b in BEFORE}
    rows.append({"name": "kept, most that the noise allows"} | bound)
    for what, column in (("inside", 0), ("across an edge", 1)):
        known = zip(robot.links, 1e3 * eps[:, column], strict=True)
        base = {link: float(e) for link, e in known if np.isfinite(e)}
        rows.append({"name": f"calibrated base {what} [mm]"} | base)
    return rows, _checks(rows[1])


def _calibrated_ranges(noise: ZoneErrors, skin: Skin) -> RangeTable:
    """What `flinch calibrate ranges` would find of these sensors."""
    walls = []
    for d in DISTANCES:
        frames = np.array([noise.reported(np.full(skin.slots, d)) for _ in range(FRAMES)])
        walls += [(k, d, frames[:, skin.zones(k)]) for k in range(skin.count)]
    return complete(table_of(walls, skin.first))


def _samples(robot: Robot, skin: Skin, rng: np.random.Generator, seed: int) -> list[Sample]:
    """Random postures, by turns among spheres and alone, read without errors."""
    spheres = world_of_spheres(rng)
    alone = SimulatedSkin(robot, skin, World(()), seed, budget=ZONES)
    among = SimulatedSkin(robot, skin, spheres, seed, budget=ZONES)
    samples = []
    for i in range(2 * POSTURES):
        posture = robot.posture(rng.uniform(-2.6, 2.6, robot.n))
        source = alone if i % 2 else among
        readings = [source.read(k, posture) for k in range(skin.count)]
        depth = np.concatenate([r.depth for r in readings])
        label = np.concatenate([r.label for r in readings])
        samples.append(Sample(posture, depth, label))
    return samples


def _calibrated_eps(
    robot: Robot, skin: Skin, judge: SelfFilter, ranges: RangeTable, noise: ZoneErrors,
    samples: list[Sample],
) -> Array:  # fmt: skip
    """Thresholds (L, 2) [m] that `flinch calibrate filter` would suggest."""
    rules, parts = Rules(), []
    everyone, slots = np.arange(skin.count), np.arange(skin.slots)
    least = skin.traits.limits[skin.sensor_of, 0]
    for posture, depth, label in samples:
        mine = (label >= 0) & (depth > least)
        z = ranges.corrected(slots, noise.reported(np.where(mine, depth, 1.0)))
        seen = judge.judge(everyone, z, posture, rules)
        mine &= seen.link >= 0
        parts.append((seen.link[mine], seen.gap[mine], skin.noise(z)[mine], seen.edge[mine]))
    link, gap, sigma, edge = (np.concatenate(column) for column in zip(*parts, strict=True))
    found = suggest(robot.links, link, gap, sigma, edge)
    return np.array([[s.eps, s.edge] for s in found])


def _shares(
    skin: Skin,
    judge: SelfFilter,
    ranges: RangeTable | None,
    noise: ZoneErrors,
    samples: list[Sample],
) -> dict[str, float]:
    """How many zones saw the body, and the shares kept of each kind of return."""
    kept: dict[str, list[NDArray[np.bool_]]] = {}
    rules, everyone = Rules(), np.arange(skin.count)
    for posture, depth, label in samples:
        for what, (mask, true) in _returns(depth, label).items():
            z = noise.reported(np.where(mask, true, 1.0))
            if ranges is not None:
                z = ranges.corrected(np.arange(skin.slots), z)
            judged = judge.judge(everyone, z, posture, rules)
            keep = judged.verdict == Verdict.KEPT
            kept.setdefault(what, []).append(keep[mask])
            kept.setdefault(f"{what}, inside", []).append(keep[mask & ~judged.edge])
    zones = sum(len(k) for k in kept["self"])
    return {"zones": zones} | {w: float(np.concatenate(k).mean()) for w, k in kept.items()}


def _returns(depth: Array, label: NDArray[np.int16]) -> dict[str, tuple[NDArray[np.bool_], Array]]:
    """By kind of return: which zones (S,) have one, and from which true depth [m]."""
    own, past = (label >= 0) & (depth > NEAREST), label == -1
    return {
        "self": (own, depth),
        "touching": (own, depth - 0.002),
        "past": (past, depth),
        **{f"{100 * b:g} cm": (own & (depth > b + 0.02), depth - b) for b in BEFORE},
    }


def _checks(calibrated: dict[str, Any]) -> list[Check]:
    near = [
        Check(f"obstacle {w} before the body kept", calibrated[w], "", 0.99, at_least=True)
        for w in ("5 cm", "2 cm", "1 cm")
    ]
    return [
        Check("obstacle 10 cm before the body kept", calibrated["10 cm"], "", 1.0, at_least=True),
        *near,
        Check("self returns kept", calibrated["self"], "", 0.001),
    ]


def _bound(samples: list[Sample], before: float) -> float:
    """Share of obstacles that a filter with the true depth and the best threshold would keep."""
    out: list[Array] = []
    for _, depth, label in samples:
        own = (label >= 0) & (depth > max(NEAREST, before + 0.02))
        sigma, nearer = deviation(depth[own]), deviation(depth[own] - before)
        out.append((before - SIGMAS * sigma) / nearer)
    return float(np.mean([0.5 * (1.0 + erf(x / sqrt(2.0))) for x in np.concatenate(out)]))
