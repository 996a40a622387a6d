"""The self filter's verdicts beside the simulator's labels: what is lost, what passes."""

from dataclasses import replace
from typing import Any

import numpy as np

from app.config import Params
from app.messages import Array, Verdict
from app.perception.calibration import suggest
from app.perception.self_filter import SelfFilter
from app.robot.model import Robot
from app.robot.skin import Skin, range_noise
from app.sensing.simulated import SimulatedSkin
from app.studies.report import Check
from app.world.world import World

BEFORE = (0.01, 0.02, 0.05, 0.10)  # [m] of obstacles before the body
POSTURES = 60
BIAS, NEAR_OFFSET, NEAR_RANGE = 0.015, 0.005, 0.2  # as of the simulated sensors
TIGHT = Params(eps_min=0.005)  # so that a calibrated threshold may be smaller than the default


def confusion(robot: Robot, skin: Skin, seed: int) -> tuple[list[dict[str, Any]], list[Check]]:
    """Shares kept with the default thresholds and with calibrated ones, noise on."""
    rng = np.random.default_rng(seed)
    bias = np.clip(rng.normal(0.0, BIAS, (skin.count, 64)), -0.04, 0.04)

    def measured(depth: Array) -> Array:
        """The error model of the simulated sensors."""
        near = NEAR_OFFSET * np.clip(1.0 - depth / NEAR_RANGE, 0.0, 1.0)
        return depth * (1.0 + bias) + near + rng.normal(size=depth.shape) * range_noise(depth)

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
    # calibration sees the first half of the postures, the figures come from the second
    judge = SelfFilter(robot, skin)
    parts: list[tuple[Array, Array, Array]] = []
    for posture, depth, label in samples[:POSTURES]:
        mine = (label >= 0) & (depth > TIGHT.range_min)
        z = measured(np.where(mine, depth, 1.0))
        _, way, gap, _ = judge.judge(everyone, z, posture, TIGHT)
        mine &= way >= 0
        parts.append((way[mine].astype(np.float64), gap[mine], z[mine]))
    way, gap, z = (np.concatenate([p[i] for p in parts]) for i in range(3))
    found = suggest(robot.links, way.astype(np.int16), gap, z, TIGHT.eps_sigmas)
    eps = np.array([s.eps for s in found])
    calibrated = SelfFilter(replace(robot, eps=eps), skin)
    rows: list[dict[str, Any]] = []
    shares: dict[str, dict[str, float]] = {}
    for name, filt, params in (
        ("default", judge, Params()), ("calibrated", calibrated, TIGHT),
    ):  # fmt: skip
        kept: dict[str, list[Array]] = {}
        for posture, depth, label in samples[POSTURES:]:
            own = (label >= 0) & (depth > 0.05)
            far = label == -1
            for what, mask, true in (
                ("self", own, depth),
                ("touching", own, depth),
                ("past", far, depth),
                *((f"{100 * b:g} cm", own & (depth > b + 0.02), depth - b) for b in BEFORE),
            ):
                if what == "touching":
                    true = depth - 0.002
                z = measured(np.where(mask, true, 1.0))
                verdict = filt.judge(everyone, z, posture, params)[0]
                kept.setdefault(what, []).append(verdict[mask] == Verdict.KEPT)
        shares[name] = {what: float(np.concatenate(k).mean()) for what, k in kept.items()}
        counts = {"zones": int(sum(len(k) for k in kept["self"]))}
        rows.append({"name": f"kept, {name} thresholds"} | counts | shares[name])
    rows.append(
        {"name": "calibrated base [mm]"}
        | {s.link: 1e3 * s.eps for s in found if np.isfinite(s.eps)}
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
