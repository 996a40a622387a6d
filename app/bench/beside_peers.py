"""The same work by other packages, in one run and on one thread: self filter and closest pair.

B1, the self filter: where does the centre ray of each zone meet the robot? The paper's way
rebuilds a ray tree of the posed mesh every tick. B2, the closest pair of every link to a
cloud of 100, 500 and 1920 points, exactly. Ours is timed before and after each peer. A peer
that is not installed is a row that says so: `pip install 'flinch[peers]'`, and `make
peers-env` for those with an environment of their own.
"""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from app.bench.beside_elsewhere import beside_open3d, beside_roboplan
from app.bench.clouds import centre_rays, count_unlike, points_outside
from app.bench.peers import geometry
from app.bench.perception import make_scene, timed, with_bodies, with_visuals
from app.choices import build_robot_and_skin
from app.judge.reference import nearest_of, triangles_of
from app.messages import Array
from app.perception.casting import NEAR
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.report import Check, Report
from app.robot.meshes import BodyMesh
from app.robot.model import Robot
from app.robot.skin import Skin
from app.setup import Setup

ONE = Rules(footprint=False)
CLOUDS = (100, 500, 1920)
REBUILT, EXACT = 100.0, 10.0  # how many times faster ours should be
OURS = 200  # timed calls


def bench_peers(seed: int = 0, urdf: Path | None = None) -> Report:
    """Time everyone; with `urdf` on that description's visual meshes, else on our own."""
    robot, skin = build_robot_and_skin(Setup(robot="ur10e"))
    heavy = with_visuals(robot, urdf) if urdf else with_bodies(robot, own_visuals(robot))
    rows, checks = [], []
    for name, arm in (("body", robot), ("visual", heavy)):
        more, found = _filters(name, arm, skin, seed)
        rows += more
        checks += found if name == "visual" else []
    for part in (
        _pairs(robot, seed),
        beside_open3d(robot, skin, seed),
        beside_roboplan(robot, skin, seed),
    ):
        rows += part[0]
        checks += part[1]
    return Report("bench peers", seed, rows, checks)


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
    rays = [centre_rays(skin, posture, NEAR) for posture, _ in scene]
    truth = [judge.judge(everyone, depth, posture, ONE).gap + depth for posture, depth in scene]
    rows: list[dict[str, Any]] = []
    checks = []
    for peer, module, make, repeats in geometry.RAYS:
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
            count_unlike(cast(posture.T_base_link, *r) + NEAR, t.ravel(), length)
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
        points = points_outside(body, posture, rng, n)
        use = np.ones(n, dtype=bool)
        sample = points[:100]
        truth = np.array([nearest_of(sample, t) for t in triangles])
        found = body.search(sample, use[:100], posture).distance
        error = float(np.abs(found - truth).max())
        rows.append({"name": f"B2 {n} points: ours", "worst_m": error})

        def ours(_: int, points: Array = points, use: Any = use) -> None:
            body.search(points, use, posture)

        for peer, module, make, most in geometry.DISTANCES:
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


def _installed(module: str) -> bool:
    try:
        importlib.import_module(module)
    except ImportError:
        return False
    return True
