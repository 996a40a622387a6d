"""The self filter's verdicts beside the simulator's labels: what is lost, what passes.

Noise limits what any filter can do: whoever removes 99.9 % of the self returns must put the
threshold 3.1 sigmas before the body, and loses what noise carries beyond it. That bound is
printed beside the filter's figures.
"""

from dataclasses import replace
from math import erf, sqrt
from typing import Any

import numpy as np

from app.checks.range_calibration import DISTANCES, FRAMES, table_of
from app.config import Params
from app.messages import Array, Verdict
from app.perception.calibration import suggest
from app.perception.self_filter import SelfFilter
from app.report import Check
from app.robot.model import Robot
from app.robot.ranges import complete
from app.robot.skin import Skin, range_noise
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

BEFORE = (0.01, 0.02, 0.05, 0.10)  # [m] of obstacles before the body
POSTURES = 150  # calibrated with, and as many to judge
ERRORS = ErrorModel()  # of the simulated sensors
SIGMAS = 3.0902  # of a normal distribution: 0.1 % lie beyond


def confusion(robot: Robot, skin: Skin, seed: int) -> tuple[list[dict[str, Any]], list[Check]]:
    """Shares kept with the default thresholds and with calibrated ones, noise on."""
    rng = np.random.default_rng(seed)
    bias = np.clip(rng.normal(0.0, ERRORS.zone_bias, (skin.count, 64)), -0.04, 0.04)

    def measured(depth: Array) -> Array:
        """The error model of the simulated sensors."""
        near = ERRORS.near_offset * np.clip(1.0 - depth / ERRORS.near_range, 0.0, 1.0)
        return depth * (1.0 + bias) + near + rng.normal(size=depth.shape) * range_noise(depth)

    walls = []
    for d in DISTANCES:
        frames = np.array([measured(np.full(bias.shape, d)) for _ in range(FRAMES)])
        walls += [(k, d, frames[:, k]) for k in range(skin.count)]
    ranges = complete(table_of(walls, skin.count))

    clutter = World(())
    for _ in range(14):
        clutter.add("", {"kind": "sphere", "radius_m": 0.12}, tuple(rng.uniform(-1.0, 1.0, 3)))
    eye = SimulatedSkin(robot, skin, World(()), seed)
    wide = SimulatedSkin(robot, skin, clutter, seed)
    samples = []
    for i in range(2 * POSTURES):
        posture = robot.posture(rng.uniform(-2.6, 2.6, robot.n))
        source = eye if i % 2 else wide
        readings = [source.read(k, posture) for k in range(skin.count)]
        depth, label = (np.array([getattr(r, n) for r in readings]) for n in ("depth", "label"))
        samples.append((posture, depth, label))
    everyone = np.arange(skin.count)
    params = Params()
    # calibration sees the first half of the postures, the figures come from the second
    judge = SelfFilter(robot, skin)
    parts: list[tuple[Any, ...]] = []
    for posture, depth, label in samples[:POSTURES]:
        mine = (label >= 0) & (depth > params.range_min)
        z = ranges.corrected(everyone, measured(np.where(mine, depth, 1.0)))
        seen = judge.judge(everyone, z, posture, params)
        mine &= seen.link >= 0
        parts.append((seen.link[mine], seen.gap[mine], z[mine], seen.edge[mine]))
    way, gap, z, edge = (np.concatenate([p[i] for p in parts]) for i in range(4))
    found = suggest(robot.links, way, gap, z, edge, params.eps_sigmas)
    eps = np.array([[s.eps, s.edge] for s in found])
    calibrated = SelfFilter(replace(robot, eps=eps), skin)
    rows: list[dict[str, Any]] = []
    shares: dict[str, dict[str, float]] = {}
    for name, filt, table in (("default", judge, None), ("calibrated", calibrated, ranges)):
        kept: dict[str, list[Array]] = {}
        for posture, depth, label in samples[POSTURES:]:
            own = (label >= 0) & (depth > 0.05)
            far = label == -1
            for what, mask, true in (
                ("self", own, depth),
                ("touching", own, depth - 0.002),
                ("past", far, depth),
                *((f"{100 * b:g} cm", own & (depth > b + 0.02), depth - b) for b in BEFORE),
            ):
                z = measured(np.where(mask, true, 1.0))
                if table is not None:
                    z = table.corrected(everyone, z)
                judged = filt.judge(everyone, z, posture, params)
                keep = judged.verdict == Verdict.KEPT
                kept.setdefault(what, []).append(keep[mask])
                kept.setdefault(f"{what}, inside", []).append(keep[mask & ~judged.edge])
        shares[name] = {what: float(np.concatenate(k).mean()) for what, k in kept.items()}
        counts = {"zones": int(sum(len(k) for k in kept["self"]))}
        rows.append({"name": f"kept, {name} thresholds"} | counts | shares[name])
    bound = {f"{100 * b:g} cm": _bound(samples[POSTURES:], b) for b in BEFORE}
    rows.append({"name": "kept, most that the noise allows"} | bound)
    for what, column in (("inside", 0), ("across an edge", 1)):
        rows.append(
            {"name": f"calibrated base {what} [mm]"}
            | {
                n: 1e3 * float(e)
                for n, e in zip(robot.links, eps[:, column], strict=True)
                if e == e
            }
        )
    good = shares["calibrated"]
    checks = [
        Check("obstacle 10 cm before the body kept", good["10 cm"], "", 1.0, at_least=True),
        *(
            Check(f"obstacle {w} before the body kept", good[w], "", 0.99, at_least=True)
            for w in ("5 cm", "2 cm", "1 cm")
        ),
        Check("self returns kept", good["self"], "", 0.001),
    ]
    return rows, checks


def _bound(samples: list[Any], before: float) -> float:
    """Share of obstacles that a filter with the true depth and the best threshold would keep."""
    out: list[Array] = []
    for _, depth, label in samples:
        z = depth[(label >= 0) & (depth > max(0.05, before + 0.02))]
        reach = (before - SIGMAS * range_noise(z)) / range_noise(z - before)
        out.append(reach)
    return float(np.mean([0.5 * (1.0 + erf(x / sqrt(2.0))) for x in np.concatenate(out)]))
