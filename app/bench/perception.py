"""How fast and how right perception is: timings, growth, confusion, distances.

One thread. Timings are medians and 99 % over postures of an arm among spheres; compare their
ratios, the machine may be shared. Correctness is judged by the simulator's labels and by slow
float64 answers.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from app.bench.confusion import confusion
from app.bench.exactness import filter_disagreements, worst_distance
from app.bench.spheres import world_of_spheres
from app.cell.parts import Cell
from app.choices import build_robot_and_skin
from app.messages import Array, SensorFrame
from app.perception.cloud import SkinCloud
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter, no_judgement
from app.plot import Curve, check_plot, plot_lines
from app.raycast import RigidMesh
from app.report import Check, Report
from app.robot.meshes import BodyMesh
from app.robot.model import Robot, load_urdf
from app.robot.posture import Posture
from app.robot.skin import Skin, build_skin
from app.robot.tables import Choice
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup

ONE, NINE = Rules(footprint=False), Rules()
POSTURES = 20
SENSORS = (3, 10, 30, 100, 300)
FACES = (2_000, 20_000, 200_000)
TURN, TURNS = 40, 6  # calls in a turn, and turns, of each size

Scene = list[tuple[Posture, Array]]


def bench_perception(
    seed: int = 0, repeats: int = 500, urdf: Path | None = None, plot: Path | None = None
) -> Report:
    """Everything; `urdf` adds a description whose visual meshes become the bodies, `plot` draws
    how the times grow.
    """
    if plot is not None:
        check_plot(plot)
    robot, skin = build_robot_and_skin(Setup(robot="ur10e"))
    scene = make_scene(robot, skin, seed)
    rows, checks = _times(robot, skin, scene, repeats, "")
    if urdf is not None:
        heavy = with_visuals(robot, urdf)
        more, late = _times(heavy, skin, scene, repeats, "visual meshes: ")
        again, _ = _times(robot, skin, scene, repeats, "again: ")
        rows += more + again
        for old, new, check in zip(again, more, late[::2], strict=False):
            ratio = new["p50_ms"] / old["p50_ms"]
            checks.append(Check(f"{check.name} over body meshes", ratio, "x", 1.5))
    grown, more_checks = _growth(robot, skin, scene, seed)
    if plot is not None:
        _draw(plot, grown)
    judged, verdicts = confusion(robot, skin, seed)
    wrong, compared = filter_disagreements(robot, skin, scene[:6], ONE)
    more_wrong, more_compared = filter_disagreements(robot, skin, scene[6:8], NINE)
    wrong, compared = wrong + more_wrong, compared + more_compared
    worst, cases = worst_distance(robot, 10_000, seed)
    rows += grown + judged
    rows.append({"name": "self filter against float64", "zones": compared, "wrong": wrong})
    rows.append({"name": "distances against float64", "cases": cases, "worst_m": worst})
    checks += [*more_checks, *verdicts]
    checks.append(Check("verdicts unlike float64 beyond 0.1 mm", wrong, "zones", 0.0))
    checks.append(Check("distance error", worst, "m", 1e-5))
    return Report("bench perception", seed, rows, checks)


def make_scene(robot: Robot, skin: Skin, seed: int, count: int = POSTURES) -> Scene:
    """Postures and reports (S,) [m] of an arm among spheres; 4 m where nothing is seen."""
    rng = np.random.default_rng(seed)
    eye = SimulatedSkin(robot, skin, world_of_spheres(rng), seed)
    out = []
    for _ in range(count):
        posture = robot.posture(robot.home + rng.uniform(-1.0, 1.0, robot.n))
        depth = np.concatenate([eye.read(k, posture).depth for k in range(skin.count)])
        out.append((posture, np.where(np.isfinite(depth), depth, 4.0)))
    return out


def with_visuals(robot: Robot, urdf: Path) -> Robot:
    """The robot with another description's visual meshes as its bodies, where that has the link."""
    other = load_urdf(urdf, Choice(bodies="visual"))
    theirs = dict(zip(other.links, other.bodies, strict=True))
    pairs = zip(robot.links, robot.bodies, strict=True)
    return with_bodies(robot, tuple(theirs.get(link, body) for link, body in pairs))


def with_bodies(robot: Robot, bodies: tuple[BodyMesh, ...]) -> Robot:
    """The robot with other bodies."""
    rigid = tuple(RigidMesh(b.vertices, b.faces) for b in bodies)
    return replace(robot, bodies=bodies, rigid=rigid)


def timed(call: Callable[[int], Any], repeats: int) -> Array:
    """(repeats,) [s] of calls with a running number, after a fifth as many to warm up."""
    out = []
    for i in range(repeats // 5 + repeats):
        begin = time.perf_counter()
        call(i)
        out.append(time.perf_counter() - begin)
    return np.array(out[-repeats:])


def frames_of(skin: Skin, reported: Array, stamp: float) -> list[SensorFrame]:
    """Valid frames of all sensors, of reports (S,) [m]."""
    out = []
    for k, sensor in enumerate(skin.sensors):
        status = np.full(sensor.type.zones, sensor.type.status.valid, dtype=np.uint8)
        targets = np.ones(len(status), dtype=np.uint8)
        out.append(SensorFrame(k, stamp, 0, reported[skin.zones(k)], status, targets))
    return out


def _times(
    robot: Robot, skin: Skin, scene: Scene, repeats: int, prefix: str
) -> tuple[list[dict[str, Any]], list[Check]]:
    judge, body, everyone = SelfFilter(robot, skin), BodyPairs(robot), np.arange(skin.count)
    cloud = SkinCloud(robot, skin, Cell())
    frames = [frames_of(skin, depth, 0.0) for _, depth in scene]
    views = []
    for (posture, _), f in zip(scene, frames, strict=True):
        cloud.reset()
        cloud.add_frames(f, posture, NINE)
        views.append(cloud.view(0.0))

    judged = no_judgement(skin.slots)

    def filter_with(rules: Rules) -> Callable[[int], Any]:
        return lambda i: judge.judge(
            everyone, scene[i % len(scene)][1], scene[i % len(scene)][0], rules, judged
        )

    def tick(i: int) -> None:
        n = i // 50 % len(scene)
        posture, k = scene[n][0], 2 * i % (skin.count - 1)
        cloud.add_frames(frames[n][k : k + 1], posture, NINE)
        cloud.add_frames(frames[n][k + 1 : k + 2], posture, NINE)
        body.update(cloud.view(0.0), posture)

    measured = (
        ("self filter, one ray", timed(filter_with(ONE), repeats), 0.5),
        ("self filter, nine rays", timed(filter_with(NINE), repeats), 1.5),
        (
            "closest pairs",
            timed(lambda i: body.update(views[i % len(views)], scene[i % len(scene)][0]), repeats),
            0.5,
        ),
        ("two frames and pairs of a tick", timed(tick, repeats), 0.4),
    )
    rows, checks = [], []
    for name, seconds, limit in measured:
        p50, p99 = 1e3 * np.percentile(seconds, [50, 99])
        rows.append({"name": prefix + name, "p50_ms": float(p50), "p99_ms": float(p99)})
        if not prefix:
            checks.append(Check(f"{name}, median", float(p50), "ms", limit))
            checks.append(Check(f"{name}, 99 %", float(p99), "ms", 2 * limit))
        else:
            checks += [Check(prefix + name, float(p50), "ms", 1.5 * limit)] * 2
    return rows, checks


def _growth(
    robot: Robot, skin: Skin, scene: Scene, seed: int
) -> tuple[list[dict[str, Any]], list[Check]]:
    """Self filter and pairs with more sensors, and with finer bodies of the same shape."""
    rng = np.random.default_rng(seed)
    calls: dict[str, tuple[Callable[[int], Any], Callable[[int], Any]]] = {}
    for count in SENSORS:
        many = build_skin("many", tuple(skin.sensors[i % skin.count] for i in range(count)), robot)
        calls[f"{count} sensors"] = _both(robot, many, scene[:5], rng)
    for count in FACES:
        fine = with_bodies(robot, tuple(_ellipsoid(b, count // 7) for b in robot.bodies))
        calls[f"{count} faces"] = _both(fine, skin, scene[:5], rng)
    # in turns, since a shared machine is faster in one minute than in the next
    rounds = [
        {k: [timed(f, TURN) for f in both] for k, both in calls.items()} for _ in range(TURNS)
    ]
    found = {}
    for name in calls:
        filtered, pairs = (np.concatenate([r[name][i] for r in rounds]) for i in range(2))
        median = (1e3 * float(np.median(seconds)) for seconds in (filtered, pairs))
        found[name] = dict(zip(("filter_ms", "pairs_ms"), median, strict=True))
    rows: list[dict[str, Any]] = [{"name": name} | times for name, times in found.items()]
    low, high = FACES[0], FACES[-1]
    allowed = float(np.log(high) / np.log(low))
    checks = [
        Check(
            "300 sensors over 30, self filter",
            found["300 sensors"]["filter_ms"] / found["30 sensors"]["filter_ms"], "x", 12.0,
        ),
        Check(
            "faces 2k to 200k, self filter",
            found[f"{high} faces"]["filter_ms"] / found[f"{low} faces"]["filter_ms"], "x", allowed,
        ),
        Check(
            "faces 2k to 200k, closest pairs",
            found[f"{high} faces"]["pairs_ms"] / found[f"{low} faces"]["pairs_ms"], "x", allowed,
        ),
    ]  # fmt: skip
    return rows, checks


def _draw(path: Path, rows: list[dict[str, Any]]) -> None:
    panels: dict[str, dict[str, Curve]] = {}
    for what in ("sensors", "faces"):
        mine = [r for r in rows if str(r["name"]).endswith(what)]
        count = [float(str(r["name"]).split()[0]) for r in mine]
        panels[f"by number of {what}"] = {
            "self filter": (count, [r["filter_ms"] for r in mine]),
            "closest pairs": (count, [r["pairs_ms"] for r in mine]),
        }
    plot_lines(path, panels, "number", "median [ms]")


def _both(
    robot: Robot, skin: Skin, scene: Scene, rng: np.random.Generator
) -> tuple[Callable[[int], Any], Callable[[int], Any]]:
    """The self filter and the closest pairs of a whole set, to be timed."""
    judge, body, everyone = SelfFilter(robot, skin), BodyPairs(robot), np.arange(skin.count)
    depth = rng.uniform(0.1, 2.0, skin.slots)
    cloud = SkinCloud(robot, skin, Cell())
    cloud.add_frames(frames_of(skin, depth, 0.0), scene[0][0], NINE)
    view, n = cloud.view(0.0), len(scene)
    return (
        lambda i: judge.judge(everyone, depth, scene[i % n][0], NINE),
        lambda i: body.update(view, scene[i % n][0]),
    )


def _ellipsoid(body: BodyMesh, faces: int) -> BodyMesh:
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    n = max(4, round(np.sqrt(faces / 2)))
    ball: Any = trimesh.creation.uv_sphere(radius=1.0, count=[n, n])
    vertices = (low + high) / 2 + ball.vertices * (high - low) / 2
    return BodyMesh(np.array(vertices), np.array(ball.faces, dtype=np.int64))
