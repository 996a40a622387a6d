"""Perception's answers beside slow ones in float64."""

from collections.abc import Sequence

import numpy as np

from app.judge.reference import first_hit, nearest_of, triangles_of
from app.messages import Array, Verdict
from app.perception.casting import NEAR
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.sensor_type import SensorType
from app.robot.skin import Skin

BAND = 1e-4  # [m] around the threshold in which float32 rays may err


def filter_disagreements(
    robot: Robot, skin: Skin, scene: Sequence[tuple[Posture, Array]], rules: Rules
) -> tuple[int, int]:
    """Zones whose verdict is not that of rays cast in float64, and zones compared."""
    judge, wrong, compared = SelfFilter(robot, skin), 0, 0
    everyone = np.arange(skin.count)
    for number, (posture, reported) in enumerate(scene):
        judged = judge.judge(everyone, reported, posture, rules)
        bodies = [
            triangles_of(b.vertices, b.faces, T)
            for b, T in zip(robot.bodies, posture.T_base_link, strict=True)
        ]
        everything = np.concatenate(bodies)
        for k in range(number % 6, skin.count, 6):
            T = posture.T_base_link[skin.link[k]]
            origin, kind = T[:3, :3] @ skin.origin[k] + T[:3, 3], skin.sensors[k].type
            for slot in range(skin.first[k], skin.first[k + 1]):
                reports = [
                    first_hit(origin, T[:3, :3] @ ray, everything, NEAR)
                    * (1.0 if kind.radial else ray @ skin.axis[k])
                    for ray in skin.rays[slot, : judged.rays[slot]]
                ]
                gaps = _pulses(np.array(reports), kind) - reported[slot]
                limit = judged.eps[slot]
                if np.any(np.abs(np.abs(gaps) - limit) < BAND):
                    continue
                truth = Verdict.KEPT
                if np.any(np.abs(gaps) <= limit):
                    truth = Verdict.SELF
                elif len(gaps) and gaps[0] < 0.0:
                    truth = Verdict.BEHIND
                wrong += judged.verdict[slot] != truth
                compared += 1
    return int(wrong), compared


def _pulses(depth: Array, kind: SensorType) -> Array:
    """Distances [m] of the groups of returns that merge, near to far; +inf is no return."""
    rest, out = np.sort(depth[np.isfinite(depth)]), []
    while len(rest):
        group = rest <= rest[0] + max(kind.pulse_m, kind.pulse_share * rest[0])
        out.append(rest[group].mean())
        rest = rest[~group]
    return np.array(out)


def worst_distance(robot: Robot, cases: int, seed: int) -> tuple[float, int]:
    """Largest error [m] of a link's smallest signed distance over random cases.

    Clouds of none to four points: near and far, on the surface, inside, with NaN rows.
    """
    rng = np.random.default_rng(seed)
    search, worst, done = BodyPairs(robot), 0.0, 0
    while done < cases:
        posture = robot.posture(rng.uniform(-3.0, 3.0, robot.n))
        for _ in range(10):
            link = int(rng.integers(len(robot.links)))
            body, T = robot.bodies[link], posture.T_base_link[link]
            n = int(rng.integers(0, 5))
            corners = body.vertices[body.faces[rng.integers(len(body.faces), size=n)]]
            share = rng.dirichlet(np.ones(3), n)
            local = np.einsum("nij,ni->nj", corners, share)  # on the surface
            kind = rng.integers(4)
            if kind == 1:
                local = local + rng.normal(scale=0.2, size=(n, 3))
            elif kind == 2:  # inwards, towards the middle of the link
                local = local + rng.uniform(0.0, 1.0, (n, 1)) * (body.vertices.mean(0) - local)
            points = local @ T[:3, :3].T + T[:3, 3]
            if kind == 3 and n:
                points[rng.integers(n)] = np.nan
            found = search.search(points, np.ones(n, dtype=bool), posture).distance[link]
            triangles = triangles_of(body.vertices, body.faces, T)
            truth = nearest_of(points, triangles)
            if np.isfinite(truth) or np.isfinite(found):
                worst = max(worst, abs(found - truth))
            done += 1
    return float(worst), done
