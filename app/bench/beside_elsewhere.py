"""Open3D's rays, from an environment of its own, and roboplan's body filter beside ours.

roboplan judges points by whether they lie within a padding of the body; it knows no lens, so
a return from behind the robot passes. Ours is timed before and after each of them.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.bench import elsewhere
from app.bench.clouds import centre_rays, count_unlike, points_outside
from app.bench.peers.geometry import roboplan_filter
from app.bench.perception import Scene, timed
from app.bench.spheres import world_of_spheres
from app.messages import Array, Verdict
from app.perception.casting import NEAR
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.report import Check
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.simulated import SimulatedSkin

ONE, NINE, PADDING = Rules(footprint=False), Rules(), 0.03  # [m]
CLOUDS = (100, 500, 1920)
POSTURES, FAR = 10, 3.5  # [m] depth of every zone in the cloud far from the arm
CLOSE = (0.05, 0.4)  # [m] depths of the cloud close to it
OURS = 400  # timed calls
EXACT = 10.0  # times faster that ours should be
NEAR_FASTER = 5.0
Found = tuple[list[dict[str, Any]], list[Check]]


def labelled(robot: Robot, skin: Skin, seed: int) -> tuple[Scene, list[NDArray[np.int16]]]:
    """Postures and noisy reports (S,) [m] of an arm among spheres, and what each zone saw."""
    rng = np.random.default_rng(seed)
    eye = SimulatedSkin(robot, skin, world_of_spheres(rng), seed)
    scene, labels = [], []
    for _ in range(POSTURES):
        posture = robot.posture(robot.home + rng.uniform(-1.0, 1.0, robot.n))
        readings = [eye.read(k, posture) for k in range(skin.count)]
        depth = np.concatenate([r.depth for r in readings])
        depth[~np.isfinite(depth)] = 4.0
        scene.append((posture, depth + rng.normal(size=depth.shape) * skin.noise(depth)))
        labels.append(np.concatenate([r.label for r in readings]))
    return scene, labels


def beside_roboplan(robot: Robot, skin: Skin, seed: int) -> Found:
    """The self filter on clouds near the arm and far from it: time, and what is kept."""
    name = "B1 roboplan"
    if find_spec("roboplan") is None:
        return [{"name": name, "note": "roboplan is not installed"}], []
    scene, labels = labelled(robot, skin, seed)
    judge, everyone = SelfFilter(robot, skin), np.arange(skin.count)
    around = np.array([_points(skin, p, d) for p, d in scene])

    def ours(rules: Rules, depth: Array | None) -> Array:
        def call(i: int) -> None:
            posture, seen = scene[i % POSTURES]
            judge.judge(everyone, seen if depth is None else depth, posture, rules)

        return timed(call, OURS)

    def all_ours() -> dict[str, Array]:
        return {
            f"{words} {cloud}": ours(rules, depth)
            for words, rules in (("one", ONE), ("nine", NINE))
            for cloud, depth in (("around", None), ("near", close), ("far", distant))
        }

    distant = np.full_like(scene[0][1], FAR)
    close = np.random.default_rng(seed).uniform(*CLOSE, distant.shape)
    first = all_ours()
    clouds = {
        "around": around,
        "near": np.array([_points(skin, p, close) for p, _ in scene]),
        "far": np.array([_points(skin, p, distant) for p, _ in scene]),
    }
    theirs = {
        (method, cloud): roboplan_filter(robot, method, PADDING, scene, points)
        for method in ("Narrowphase", "PaddedObb")
        for cloud, points in clouds.items()
    }
    again = all_ours()
    label = np.array(labels).reshape(POSTURES, -1)
    median = {k: 1e3 * float(np.median(np.concatenate((first[k], again[k])))) for k in first}
    rows: list[dict[str, Any]] = []
    for words, rules in (("one", ONE), ("nine", NINE)):
        kept = np.array(
            [judge.judge(everyone, d, p, rules).verdict.ravel() == Verdict.KEPT for p, d in scene]
        )
        times = {f"{cloud}_ms": median[f"{words} {cloud}"] for cloud in ("around", "near", "far")}
        rows.append({"name": f"{name}: ours, rays a zone: {words}"} | times | _kept(kept, label))
    more, checks = _roboplans(name, theirs, median, label)
    return rows + more, checks


def _roboplans(
    name: str,
    theirs: dict[tuple[str, str], tuple[Array, NDArray[np.bool_]]],
    median: dict[str, float],
    label: NDArray[np.int16],
) -> Found:
    """roboplan's times [s] and masks by method and cloud, beside our medians [ms]."""
    rows, checks = [], []
    for method, words in (("Narrowphase", "exact"), ("PaddedObb", "boxes")):
        for cloud in ("around", "near", "far"):
            seconds, mask = theirs[method, cloud]
            ms = 1e3 * float(np.median(seconds))
            mine = median[f"nine {cloud}"]  # as accurate; one ray lets edges pass
            row: dict[str, Any] = {"name": f"{name}, {words}, cloud {cloud}", "ms": ms}
            row |= {"ours_ms": mine, "ratio": ms / mine}
            rows.append(row | (_kept(~mask, label) if cloud == "around" else {}))
            if words == "exact":
                limit = NEAR_FASTER if cloud == "near" else 1.0
                checks.append(
                    Check(f"{row['name']}, over ours", ms / mine, "x", limit, at_least=True)
                )
    return rows, checks


def beside_open3d(robot: Robot, skin: Skin, seed: int) -> Found:
    """Rays against the posed arm and nearest points, on body meshes."""
    name = "Open3D"
    if elsewhere.interpreter("open3d") is None:
        return [{"name": name, "note": "no environment; make it with: make peers-env"}], []
    scene = labelled(robot, skin, seed)[0][:5]
    judge, everyone, body = SelfFilter(robot, skin), np.arange(skin.count), BodyPairs(robot)
    rays = [centre_rays(skin, posture, NEAR) for posture, _ in scene]
    rng = np.random.default_rng(seed)
    clouds = {n: points_outside(body, scene[0][0], rng, n) for n in CLOUDS}

    def filter_ours() -> Array:
        return timed(lambda i: judge.judge(everyone, scene[i % 5][1], scene[i % 5][0], ONE), OURS)

    def pairs_ours(n: int) -> Array:
        use = np.ones(n, dtype=bool)
        return timed(lambda i: body.search(clouds[n], use, scene[0][0]), OURS)

    first = {"filter": filter_ours()} | {str(n): pairs_ours(n) for n in CLOUDS}
    answer = elsewhere.run(
        "open3d", links=np.array(len(robot.bodies)),
        T_base_link=np.array([p.T_base_link for p, _ in scene]),
        origins=np.array([o for o, _ in rays]), directions=np.array([d for _, d in rays]),
        **{f"vertices_{i}": b.vertices for i, b in enumerate(robot.bodies)},
        **{f"faces_{i}": b.faces for i, b in enumerate(robot.bodies)},
        **{f"points_{n}": p for n, p in clouds.items()},
    )  # fmt: skip
    again = {"filter": filter_ours()} | {str(n): pairs_ours(n) for n in CLOUDS}
    mine = {k: 1e3 * float(np.median(np.concatenate((first[k], again[k])))) for k in first}
    length = np.linalg.norm(skin.reach, axis=1)
    truth = [(judge.judge(everyone, d, p, ONE).gap + d).ravel() for p, d in scene]
    rows, checks = [], []
    for key, words, limit in (("rebuilt", "rebuilt", EXACT), ("links", "a scene a link", 1.0)):
        theirs = 1e3 * float(np.median(answer[f"{key}_s"]))  # type: ignore[type-var]
        hits = answer[f"{key}_answer"]
        wrong = max(count_unlike(h + NEAR, t, length) for h, t in zip(hits, truth, strict=True))
        row = {"name": f"B1 {name}, {words}", "ms": theirs, "ours_ms": mine["filter"]}
        rows.append(row | {"ratio": theirs / mine["filter"], "unlike": wrong})
        checks.append(
            Check(f"{row['name']}, over ours", theirs / mine["filter"], "x", limit, at_least=True)
        )
    for n in CLOUDS:
        theirs = 1e3 * float(np.median(answer[f"points_{n}_s"]))  # type: ignore[type-var]
        found = body.search(clouds[n], np.ones(n, dtype=bool), scene[0][0]).distance
        worst = float(np.abs(answer[f"points_{n}_answer"][0] - found).max())
        row = {"name": f"B2 {n} points: {name}", "ms": theirs, "ours_ms": mine[str(n)]}
        rows.append(row | {"ratio": theirs / mine[str(n)], "worst_m": worst})
        checks.append(
            Check(f"{row['name']}, over ours", theirs / mine[str(n)], "x", EXACT, at_least=True)
        )
    return rows, checks


def _points(skin: Skin, posture: Any, depth: Array) -> Array:
    """(S, 3) [m] base frame, of reports (S,)."""
    T = posture.T_base_link[skin.link[skin.sensor_of]]
    local = skin.origin[skin.sensor_of] + depth[:, None] * skin.reach
    return np.asarray(np.einsum("sij,sj->si", T[:, :3, :3], local) + T[:, :3, 3])


def _kept(kept: NDArray[np.bool_], label: NDArray[np.int16]) -> dict[str, float]:
    """Shares kept of the robot's own returns and of the world's."""
    return {
        "self_kept": float(kept[label >= 0].mean()), "world_kept": float(kept[label == -1].mean()),
    }  # fmt: skip
