"""What margins cost: obstacles right before the body that are kept, against returns that pass.

The margins of the self filter are multiplied by a `caution`. Its frontier is drawn beside that of
the ideal filter, which knows what the body returns to each zone to the last digit and fights the
noise of the range alone: with a threshold t it passes Q(t / sigma(d)) of the returns from d, and
keeps Phi((b - t) / sigma(d - b)) of the obstacles that stand b before it.

What the zones see is the honest world's. An obstacle fills the view of each sensor that sees the
body: it stands before the body where that is, and as far away beside it; `alone` is one that hides
nothing but the body, as a sleeve would. Noise and the zones' constant errors are drawn here, as the
sensor's type has them.
"""

from math import erf, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot_and_skin
from app.messages import Array, Verdict
from app.perception.hanging import Hanging
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.report import Check, Report
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.studies.phantoms import SHARE, Condition, believed_skin
from app.world.world import World

CAUTION = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
BEFORE = (0.10, 0.05)  # [m] of obstacles before the body
TARGETS = dict(zip(BEFORE, (0.995, 0.95), strict=True))  # kept, of a calibrated skin
THRESHOLDS = tuple(np.linspace(0.0, 0.06, 13))  # [m] of the ideal filter
NEAREST, ROOM = 0.05, 0.02  # [m] nearer returns are not judged; an obstacle is at least so far
NOTHING = 9.0  # [m] beyond everything
AROUND = 1.0  # [rad] of each joint about home
CONDITIONS = (Condition("as laid out"), Condition("calibrated", calibrated=True))


class View(NamedTuple):
    """One posture: what is believed of it, and the zones (m,) that see the body, from depth [m]."""

    posture: Posture
    zones: NDArray[np.intp]
    depth: Array


def frontier(postures: int = 150, seeds: int = 2, seed: int = 0, world: str = "honest") -> Report:
    """The frontier as laid out and calibrated, of `postures` each of `seeds` arms."""
    robot, skin = build_robot_and_skin(Setup(robot="ur10e"))
    rows, checks = [], []
    for c in CONDITIONS:
        found: dict[float, list[dict[str, float]]] = {x: [] for x in CAUTION}
        views: list[View] = []
        for s in range(seed, seed + seeds):
            believed, seen = views_of(robot, skin, c, postures, s, world)
            views += seen
            for caution in CAUTION:
                rng = np.random.default_rng([s, 17])
                found[caution].append(shares(robot, believed, seen, caution, c.calibrated, rng))
        for caution in CAUTION:
            mean = {k: float(np.mean([f[k] for f in found[caution]])) for k in found[caution][0]}
            rows.append({"name": f"{c.name}, margins x {caution:g}", "filter": c.name} | mean)
            if c.calibrated and caution == 1.0:
                checks += [
                    Check(f"{1e2 * b:g} cm before the body", mean[_key(b)], "", t, at_least=True)
                    for b, t in TARGETS.items()
                ]
        if c.calibrated:
            rows += [ideal(skin, views, t) for t in THRESHOLDS]
    return Report("frontier", seed, rows, checks)


def views_of(
    robot: Robot, skin: Skin, c: Condition, postures: int, seed: int, world: str
) -> tuple[Skin, list[View]]:
    """The believed skin of a seed, and what its zones see of the arm alone."""
    rng, budget = np.random.default_rng([seed, 19]), c.budget(world)
    believed, errors = believed_skin(robot, skin, c, budget, seed)
    eye = SimulatedSkin(robot, skin, World(()), seed, errors, budget=budget)
    out = []
    for _ in range(postures):
        q = robot.home + rng.uniform(-AROUND, AROUND, robot.n)
        there = eye.truth.robot.posture(q)
        depth = np.concatenate([eye.read(k, there).depth for k in range(skin.count)])
        zones = np.flatnonzero((depth > NEAREST) & (depth < 4.0))
        read = robot.posture(q + eye.truth.encoders * rng.standard_normal(robot.n))
        out.append(View(read, zones, depth[zones]))
    return believed, out


def shares(
    robot: Robot, skin: Skin, views: list[View], caution: float, calibrated: bool,
    rng: np.random.Generator,
) -> dict[str, float]:  # fmt: skip
    """Shares that pass of the body's own returns, and that are kept of obstacles before it."""
    judge, hanging = SelfFilter(robot, skin, caution), Hanging(robot, skin)
    error = skin.sensors[0].type.error
    bias = (SHARE if calibrated else error.bias_share) * rng.standard_normal(skin.slots)
    everyone = np.arange(skin.count)
    cases = [(0.0, False), *((b, beside) for b in BEFORE for beside in (True, False))]
    kept = {case: [np.empty(0)] for case in cases}
    for posture, zones, depth in views:
        for (b, beside), found in kept.items():
            use = depth > b + ROOM
            mine, z = zones[use], np.full(skin.slots, NOTHING)
            z[mine] = depth[use] - b
            if beside:
                _fill(skin, z)
            there = z < NOTHING
            z[there] *= 1.0 + bias[there]
            z[there] += (skin.noise(z) * rng.standard_normal(skin.slots))[there]
            judged = judge.judge(everyone, z, posture, Rules())
            judged.verdict[~there] = Verdict.NO_TARGET
            hanging.mark(everyone, z, _points(skin, z, posture), posture, judged)
            found.append(judged.verdict[mine] == Verdict.KEPT)
    return {
        _key(b, alone=b > 0.0 and not beside): float(np.concatenate(found).mean())
        for (b, beside), found in kept.items()
    }


def _fill(skin: Skin, z: Array) -> None:
    """Let each sensor that sees something see it in all its zones, (S,) [m]."""
    for k in range(skin.count):
        mine = z[skin.zones(k)]
        if (mine < NOTHING).any():
            mine[mine == NOTHING] = np.median(mine[mine < NOTHING])


def ideal(skin: Skin, views: list[View], threshold: float) -> dict[str, Any]:
    """What a filter that knows the truth makes of the noise."""
    depth = np.concatenate([v.depth for v in views])
    kind = skin.sensors[0].type
    out = {"name": f"ideal filter, {1e3 * threshold:.0f} mm", "filter": "ideal"}
    normal = np.vectorize(lambda x: 0.5 * (1.0 + erf(x / sqrt(2.0))))
    passed = float(normal(-threshold / kind.noise(depth)).mean())
    rest = {b: depth[depth > b + ROOM] - b for b in BEFORE}
    return out | {_key(0.0): passed} | {
        _key(b): float(normal((b - threshold) / kind.noise(d)).mean()) for b, d in rest.items()
    }  # fmt: skip


def _key(before: float, alone: bool = False) -> str:
    how = "alone" if alone else "kept"
    return f"{how}_{1e2 * before:g}_cm" if before else "passed"


def _points(skin: Skin, z: Array, posture: Posture) -> Array:
    """(S, 3) [m] points of reports (S,), base frame."""
    k = skin.sensor_of
    local = skin.origin[k] + z[:, None] * skin.reach
    T = posture.T_base_link[skin.link[k]]
    return np.asarray(np.einsum("sij,sj->si", T[:, :3, :3], local) + T[:, :3, 3])
