"""The same work by other packages, in one run and on one thread: self filter and closest pair.

B1, the self filter: where does the centre ray of each zone meet the robot? The paper's way
rebuilds a ray tree of the posed mesh every tick. B2, the closest pair of every link to a
cloud of 100, 500 and 1920 points, exactly. Ours is timed before and after each peer. A peer
that is not installed is a row that says so: `pip install 'flinch[peers]'`.
"""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from app.config import Params
from app.messages import Array
from app.perception.proximity import BodyPairs
from app.perception.self_filter import SelfFilter
from app.robot.meshes import BodyMesh
from app.robot.model import Robot, find_robot, load_robot
from app.robot.posture import Posture
from app.robot.skin import Skin, load_skin
from app.studies import peers
from app.studies.bench_perception import make_scene, timed, with_bodies, with_visuals
from app.studies.reference import nearest_of, triangles_of
from app.studies.report import Check, Report

ONE = Params(footprint=False)
CLOUDS = (100, 500, 1920)
REBUILT, EXACT = 100.0, 10.0  # how many times faster ours should be
OURS = 200  # timed calls


def bench_peers(seed: int = 0, urdf: Path | None = None) -> Report:
    """Time everyone; with `urdf` on that description's visual meshes, else on our own."""
    robot = load_robot(find_robot("ur10e"))
    assert robot.skin is not None
    skin = load_skin(robot.folder / robot.skin, robot)
    heavy = with_visuals(robot, urdf) if urdf else with_bodies(robot, own_visuals(robot))
    rows, checks = [], []
    for name, arm in (("body", robot), ("visual", heavy)):
        more, found = _filters(name, arm, skin, seed)
        rows += more
        checks += found if name == "visual" else []
    more, found = _pairs(robot, seed)
    return Report("bench peers", seed, rows + more, checks + found)


def own_visuals(robot: Robot) -> tuple[BodyMesh, ...]:
    """The visual meshes of the robot's own description."""
    meshes: list[Any] = [
        trimesh.util.concatenate(robot.visual(link).dump()) for link in robot.links
    ]
    return tuple(BodyMesh(np.array(m.vertices), np.array(m.faces, dtype=np.int64)) for m in meshes)


def _filters(
    name: str, robot: Robot, skin: Skin, seed: int
) -> tuple[list[dict[str, Any]], list[Check]]:
    scene = make_scene(robot, skin, seed, 5)
    judge, everyone = SelfFilter(robot, skin), np.arange(skin.count)
    faces = sum(len(b.faces) for b in robot.bodies)

    def ours(i: int) -> None:
        judge.judge(everyone, scene[i % 5][1], scene[i % 5][0], ONE)

    length = np.linalg.norm(skin.reach, axis=1)
    rays = [_rays(skin, posture) for posture, _ in scene]
    truth = [judge.judge(everyone, depth, posture, ONE)[2] + depth for posture, depth in scene]
    rows: list[dict[str, Any]] = []
    checks = []
    for peer, module, make, repeats in peers.RAYS:
        label = f"B1 {name} meshes, {faces} faces: {peer}"
        if not _installed(module):
            rows.append({"name": label, "note": f"{module} is not installed"})
            continue
        cast = make(robot.bodies)
        first = timed(ours, OURS)
        theirs = timed(lambda i: cast(scene[i % 5][0].T_base_link, *rays[i % 5]), repeats)  # noqa: B023
        mine = 1e3 * float(np.median(np.concatenate((first, timed(ours, OURS)))))
        median = 1e3 * float(np.median(theirs))
        error = max(
            _unlike(cast(posture.T_base_link, *r), t.ravel(), length)
            for (posture, _), r, t in zip(scene, rays, truth, strict=True)
        )
        rows.append(
            {"name": label, "ms": median, "ours_ms": mine, "ratio": median / mine, "unlike": error}
        )
        if "rebuilt" in peer:
            checks.append(Check(f"{label}, over ours", median / mine, "x", REBUILT, at_least=True))
    return rows, checks


def _pairs(robot: Robot, seed: int) -> tuple[list[dict[str, Any]], list[Check]]:
    rng = np.random.default_rng(seed)
    posture = robot.posture(robot.home)
    body = BodyPairs(robot)
    triangles = [
        triangles_of(b.vertices, b.faces, T)
        for b, T in zip(robot.bodies, posture.T_base_link, strict=True)
    ]
    rows, checks = [], []
    for n in CLOUDS:
        points = _outside(body, posture, rng, n)
        use = np.ones(n, dtype=bool)
        sample = points[:100]
        truth = np.array([nearest_of(sample, t) for t in triangles])
        found = body.search(sample, use[:100], posture).distance
        error = float(np.abs(found - truth).max())
        rows.append({"name": f"B2 {n} points: ours", "worst_m": error})

        def ours(_: int, points: Array = points, use: Any = use) -> None:
            body.search(points, use, posture)

        for peer, module, make, most in peers.DISTANCES:
            label = f"B2 {n} points: {peer}"
            if not _installed(module) or n > most:
                why = f"{module} is not installed" if n <= most else "left out, too slow"
                rows.append({"name": label, "note": why})
                continue
            nearest = make(robot.bodies)
            first = timed(ours, OURS)
            theirs = timed(lambda i: nearest(posture.T_base_link, points), 5)  # noqa: B023
            mine = 1e3 * float(np.median(np.concatenate((first, timed(ours, OURS)))))
            median = 1e3 * float(np.median(theirs))
            worst = float(np.abs(nearest(posture.T_base_link, sample) - np.abs(truth)).max())
            rows.append(
                {
                    "name": label, "ms": median, "ours_ms": mine, "ratio": median / mine,
                    "worst_m": worst,
                }
            )  # fmt: skip
            checks.append(Check(f"{label}, over ours", median / mine, "x", EXACT, at_least=True))
    return rows, checks


def _outside(body: BodyPairs, posture: Posture, rng: np.random.Generator, n: int) -> Array:
    """Points (n, 3) around the arm and outside of it, so that unsigned answers are the same."""
    out, one = np.empty((0, 3)), np.ones(1, dtype=bool)
    while len(out) < n:
        points = rng.uniform(-1.0, 1.0, (n, 3))
        clear = [body.search(p[None], one, posture).minimum > 0.0 for p in points]
        out = np.concatenate((out, points[clear]))
    return out[:n]


def _rays(skin: Skin, posture: Posture) -> tuple[Array, Array]:
    """Origins and unit directions (S, 3) of the centre rays, base frame, near cut applied."""
    T = np.repeat(posture.T_base_link[skin.link], 64, axis=0)
    direction = np.einsum("sij,sj->si", T[:, :3, :3], skin.reach)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    lens = np.repeat(skin.origin, 64, axis=0)
    origin = np.einsum("sij,sj->si", T[:, :3, :3], lens) + T[:, :3, 3]
    return origin + ONE.near_cut * direction, direction


def _unlike(hit: Array, depth: Array, length: Array) -> int:
    """Zones whose hit differs by more than 0.1 mm from ours, or is there for one only."""
    theirs = (hit + ONE.near_cut) / length
    both = np.isfinite(theirs) & np.isfinite(depth)
    far = np.zeros(len(hit), dtype=bool)
    far[both] = np.abs(theirs[both] - depth[both]) > 1e-4
    return int((far | (np.isfinite(theirs) != np.isfinite(depth))).sum())


def _installed(module: str) -> bool:
    try:
        importlib.import_module(module)
    except ImportError:
        return False
    return True
