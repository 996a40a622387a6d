"""A robot with seven joints, other names and another skin: nothing is made for one arm alone."""

import json

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.config import Params
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.studies.headless import run
from app.timing import ManualClock
from app.ui.page import Page
from app.wiring import build_engine
from app.world.world import World


@pytest.fixture(scope="module")
def swan():
    return load_robot(find_robot("swan7"))


@pytest.fixture(scope="module")
def rings(swan):
    return load_skin(swan.folder / swan.skin, swan)


def test_it_has_seven_joints_and_a_reach_of_about_a_metre(swan):
    assert swan.n == 7
    straight = swan.posture(np.zeros(7))
    assert straight.T_base_tool[:3, 3] == pytest.approx([0.0, 0.0, 1.28])
    shoulder = straight.T_base_link[swan.link_index("link2"), :3, 3]
    assert np.linalg.norm(straight.T_base_tool[:3, 3] - shoulder) == pytest.approx(0.98)


def test_its_axes_alternate(swan):
    J = swan.posture(np.zeros(7)).J_base
    assert np.abs(J[3:].T).round(9).tolist() == [[0, 0, 1], [0, 1, 0]] * 3 + [[0, 0, 1]]


def test_its_skin_is_one_ring_of_eight_on_each_of_two_links(swan, rings):
    links, count = np.unique(rings.link, return_counts=True)
    assert [swan.links[i] for i in links] == ["link3", "link5"] and count.tolist() == [8, 8]


def test_every_link_is_one_closed_solid(swan):
    for body in swan.bodies:
        mesh = trimesh.Trimesh(body.vertices, body.faces)
        assert mesh.is_volume and mesh.body_count == 1 and len(mesh.faces) <= 3000


def test_no_lens_is_inside_a_link_and_none_looks_at_its_own(swan, rings):
    eye = SimulatedSkin(swan, rings, World(()), 0, ErrorModel(ideal=True))
    posture = swan.posture(swan.home)
    for k in range(rings.count):
        body = swan.bodies[rings.link[k]]
        mesh = trimesh.Trimesh(body.vertices, body.faces)
        assert not mesh.contains(rings.origin[k : k + 1]).any()
        assert not (eye.read(k, posture).label == rings.link[k]).any()


def test_its_jacobians_agree_with_finite_differences(swan):
    rng, h = np.random.default_rng(1), 1e-6
    for _ in range(30):
        q, qd = rng.uniform(swan.q_min, swan.q_max), rng.normal(size=7)
        now, a, b = swan.posture(q), swan.posture(q - h * qd), swan.posture(q + h * qd)
        speed = (b.T_base_tool[:3, 3] - a.T_base_tool[:3, 3]) / (2 * h)
        spin = (b.T_base_tool[:3, :3] - a.T_base_tool[:3, :3]) / (2 * h) @ now.T_base_tool[:3, :3].T
        twist = [*speed, spin[2, 1], spin[0, 2], spin[1, 0]]
        assert now.tool_jacobian() @ qd == pytest.approx(twist, abs=1e-6)
        for link in range(len(swan.links)):
            local = rng.uniform(-0.2, 0.2, 3)
            p, before, after = (
                k.T_base_link[link, :3, :3] @ local + k.T_base_link[link, :3, 3]
                for k in (now, a, b)
            )
            world = p + rng.normal(size=3)
            normal = (p - world) / np.linalg.norm(p - world)
            rate = (np.linalg.norm(after - world) - np.linalg.norm(before - world)) / (2 * h)
            row = now.distance_rows(np.array([link]), p[None], normal[None])[0]
            assert row @ qd == pytest.approx(rate, abs=1e-6)


@pytest.mark.parametrize("mode", ["wb", "sm"])
@pytest.mark.parametrize("scene", ["cell", "front-panel"])
def test_every_controller_runs_it_in_the_shipped_scenes(mode, scene):
    record, last = run(Setup(robot="swan7", scene=scene), 1.0, Params(mode=mode))
    assert record.stops == [] and last.joints.q.shape == (7,)
    assert len(last.pairs.distance) == (8 if mode == "wb" else 16)
    assert record.overspeed <= 0 and record.overreach <= 0


def test_it_gives_way_to_a_panel_that_stands_before_its_goal():
    steady = {}
    for mode in ("wb", "sm"):
        record, _ = run(Setup(robot="swan7", scene="side-panel", seed=3), 6.0, Params(mode=mode))
        assert record.stops == []
        steady[mode] = record.steady(2.0)
    assert 0.20 < steady["wb"] < 0.30  # d_min .. d_min + delta
    assert steady["wb"] - steady["sm"] > 0.03


def test_the_command_line_runs_it(capsys):
    args = ["run", "--robot", "swan7", "--headless", "--seconds", "0.3", "--json"]
    assert main(args) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["status"] == "running"


def test_the_page_shows_it():
    engine = build_engine(Setup(robot="swan7", scene="empty"), ManualClock())
    snapshot = engine.step()
    page = Page(engine, port=0)
    try:
        page.robot.update(snapshot)
        for link, T in zip(engine.robot.links, snapshot.T_base_link, strict=True):
            handle = page.server.scene.get_handle_by_name(f"/robot/{link}")
            assert handle is not None
            assert handle.position == pytest.approx(T[:3, 3], abs=1e-6)
    finally:
        page.stop()
