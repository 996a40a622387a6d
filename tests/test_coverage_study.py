"""`flinch coverage`: the space round the arm, sums over postures, and what is written."""

import csv
import json

import numpy as np
import pytest

from app.cli import main
from app.coverage.cones import packed
from app.coverage.look import look, subject_of
from app.coverage.tally import Tally
from app.coverage.volume import NEAR, space, voxels, watched
from app.coverage.wedges import wedges
from app.errors import ConfigError
from app.record.recorder import start_recording, stop_recording
from app.robot.skin import build_skin
from app.setup import Setup
from app.studies.coverage.postures import postures_of
from app.timing import ManualClock
from app.wiring import build_engine

FEW = 400


@pytest.fixture(scope="module")
def subject(robot, skin):
    return subject_of(robot, skin, FEW)


@pytest.fixture(scope="module")
def home(robot, subject):
    return look(subject, robot.posture(robot.home))


def test_wedges_between_neighbours_of_a_ring_close_where_geometry_says(subject, home):
    """Two cones of 45 degrees, a tenth of a turn apart, on a circle of 60 mm: the edge of a cone
    meets the middle line where rho sin 18 = (rho cos 18 - 60 mm) tan 22.5."""
    half, edge = np.radians(18.0), np.tan(np.radians(22.5))
    closes = 0.06 * edge / (edge * np.cos(half) - np.sin(half)) - 0.06
    found = wedges(subject, home)
    assert len(found) == 30
    assert [w.closes for w in found] == pytest.approx([closes] * 30, abs=0.002)
    assert closes == pytest.approx(0.233, abs=0.001)


def test_a_point_is_watched_if_its_ray_comes_to_the_sensor(robot, skin, subject, home):
    """Points on the zones' middle rays, nearer and farther than where their views end."""
    eyes, zone = packed(subject.cones, home.views.free), np.arange(0, skin.slots, 7)
    k = skin.sensor_of[zone]
    T_base_link = robot.posture(robot.home).T_base_link[skin.link[k]]
    ray = np.einsum("sij,sj->si", T_base_link[:, :3, :3], skin.reach[zone])
    lens = home.T_base_sensor[k, :3, 3]
    for share, expected in ((0.99, True), (1.01, False)):
        points = lens + share * home.views.free[zone, None] * ray
        seen = watched(np.ascontiguousarray(points), home.T_base_sensor, eyes)
        assert (seen[k, np.arange(len(zone))] == expected).all()


def test_voxels_lie_round_the_arm_above_the_floor(home):
    grid, distance = voxels(home, 0.1, NEAR)
    assert (grid[:, 2] > 0.0).all()
    expected = np.linalg.norm(grid[:, None] - home.at.point, axis=2).min(axis=1)
    assert distance == pytest.approx(expected)
    assert distance.max() <= NEAR
    assert len(np.unique(grid.round(3), axis=0)) == len(grid)


def test_more_sensors_leave_less_space_blind(robot, skin, subject, home):
    few = subject_of(robot, build_skin("ring", skin.sensors[:10], robot), FEW)
    less, all_ = space(few, look(few, robot.posture(robot.home))), space(subject, home)
    assert less.blind_near > all_.blind_near and less.blind_far > all_.blind_far
    assert less.sensed < all_.sensed and less.occupancy < all_.occupancy


def test_what_a_dead_sensor_costs_is_what_is_lost_without_it(robot, skin, subject, home):
    tally = Tally(subject, 1.0)
    tally.add(home, space(subject, home))
    costs = [row["costs_20cm"] for row in tally.sensor_rows()]
    worst = int(np.argmax(costs))
    area = (subject.patches.area * tally.moving)[:, None]
    kept = np.arange(skin.count) != worst
    free = (area * ~home.barred).sum()
    with_, without = (
        float((area * (np.nan_to_num(home.seen(which)) >= 0.2)).sum() / free)
        for which in (None, kept)
    )
    assert costs[worst] == pytest.approx(with_ - without)
    assert costs[worst] > 0.005


def test_it_writes_what_it_found(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["coverage", "--patches", "300", "--out", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((out / "coverage.json").read_text())
    rows = {r["name"]: r for r in report["rows"]}
    assert 0.0 < rows["all that moves"]["seen_20cm"] < 1.0
    assert rows["wedges of ring1"]["closes_m"] == pytest.approx(0.233, abs=0.002)
    assert all(c["ok"] for c in report["checks"])
    with (out / "patches.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert {line["link"] for line in lines} >= {"forearm_link", "wrist_3_link"}
    assert all(0.0 <= float(line["seen_20cm"]) <= 1.0 for line in lines)
    assert (out / "coverage.png").stat().st_size > 10_000
    assert "the arm from four sides" in (out / "coverage.html").read_text()


def test_postures_all_over_the_workspace_keep_clear_of_the_floor(robot):
    q = postures_of("grid:3", robot)
    assert q.shape == (3, 6) and len(np.unique(q.round(6), axis=0)) == 3
    for one in q:
        T = robot.posture(one).T_base_link
        for i in np.flatnonzero(robot.supports.any(axis=1)):
            assert (robot.bodies[i].vertices @ T[i, :3, :3].T + T[i, :3, 3])[:, 2].min() > 0.0


def test_postures_of_a_program_come_to_its_waypoints(robot):
    q = postures_of("program:door-screws", robot)
    assert 20 < len(q) <= 200
    assert np.array_equal(q[0], robot.home)
    assert np.abs(np.diff(q, axis=0)).max() < 0.5


def test_postures_of_a_recording_are_those_of_its_ticks(robot, tmp_path):
    setup = Setup(rate=125.0)
    engine = build_engine(setup, ManualClock())
    recorder = start_recording(engine, setup, tmp_path / "run.mcap", threaded=False)
    at = [engine.step().joints.q for _ in range(10)]
    stop_recording(engine, recorder)
    engine.close()
    q = postures_of(f"recording:{tmp_path / 'run.mcap'}", robot)
    assert np.array_equal(q, at)


@pytest.mark.parametrize("wanted", ["everywhere", "grid:", "grid:0", "program:", "home:3"])
def test_other_postures_are_refused_with_what_there_is(robot, wanted):
    with pytest.raises(ConfigError, match="give home, grid:N, program:NAME or recording:FILE"):
        postures_of(wanted, robot)


def test_sums_are_the_same_in_one_go_and_in_portions(robot, subject):
    q = [robot.home, robot.home + 0.2, robot.home - 0.3]
    looks = [look(subject, robot.posture(one)) for one in q]
    whole, parts = Tally(subject, 1.0), Tally(subject, 1.0)
    for one in looks:
        whole.add(one, space(subject, one))
        part = Tally(subject, 1.0)
        part.add(one, space(subject, one))
        parts.sums = parts.sums.plus(part.sums)
    for a, b in zip(whole.sums, parts.sums, strict=True):
        assert np.allclose(a, b)
    assert whole.sums.looks == 3


def test_a_sensor_that_looks_into_the_arm_misses_the_check(tmp_path, capsys):
    """Named on standard error as well, with the remedy."""
    file = tmp_path / "into.toml"
    file.write_text(
        'title = "one into the arm"\n'
        '[[sensor]]\nname = "out"\nlink = "forearm_link"\nposition_m = [-0.3, 0.0, 0.1]\n'
        "direction = [0.0, 0.0, 1.0]\nup = [-1.0, 0.0, 0.0]\n"
        '[[sensor]]\nname = "into"\nlink = "forearm_link"\nposition_m = [-0.3, 0.0, 0.1]\n'
        "direction = [0.0, 0.0, -1.0]\nup = [-1.0, 0.0, 0.0]\n"
    )
    assert main(["coverage", "--skin", str(file), "--patches", "200", "--json"]) == 0
    said = capsys.readouterr()
    report = json.loads(said.out)
    assert [(c["value"], c["ok"]) for c in report["checks"]] == [(1.0, False)]
    assert "into looks into forearm_link" in said.err
