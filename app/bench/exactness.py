"""Perception's answers beside slow ones in float64."""

from collections.abc import Sequence

import numpy as np

from app.judge.reference import first_hit, nearest_of, triangles_of
from app.messages import Array, Verdict
from app.perception.casting import DEPTH, NEAR, Aims
from app.perception.footprint import Fan
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.robot.model import Robot
from app.robot.posture import Posture
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
            origin, radial = T[:3, :3] @ skin.origin[k] + T[:3, 3], skin.sensors[k].type.radial
            for slot in range(skin.first[k], skin.first[k + 1]):
                rays = directions(judge.fan, k, slot, judged.aims)
                length = np.linalg.norm(rays, axis=1)
                unit = rays / length[:, None]
                hits = np.array([first_hit(origin, T[:3, :3] @ u, everything, NEAR) for u in unit])
                hits = hits if radial else hits / length
                depth = DEPTH if rules.footprint else 0.0
                truth, near = _verdict(hits, reported[slot], judged.eps[slot], depth)
                if near:
                    continue
                wrong += judged.verdict[slot] != truth
                compared += 1
    return int(wrong), compared


def directions(fan: Fan, k: int, slot: int, aims: Aims) -> Array:
    """(n, 3) directions of unit depth of the rays that stood for a zone, link frame."""
    a, b = aims.spread[slot] * fan.offset[k, : aims.rays[slot]].T[:, :, None]
    return np.asarray(fan.centre[slot] + a * fan.across[slot] + b * fan.down[slot])


def _verdict(hits: Array, reported: float, eps: float, depth: float) -> tuple[Verdict, bool]:
    """What a zone saw whose rays end at `hits` (n,), and whether rounding might say otherwise."""
    before, behind = hits - reported, reported - (hits + depth)
    outside = np.maximum(np.maximum(before, behind), 0.0)
    near = bool(np.any(np.abs(outside - eps) < BAND) or abs(behind[0]) < BAND)
    if np.any(outside <= eps):
        return Verdict.SELF, near
    return (Verdict.BEHIND if behind[0] > 0.0 else Verdict.KEPT), near


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
