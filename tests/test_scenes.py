"""Scene files: every shipped one holds what it promises, every bad one is told in one line."""

import math

import numpy as np
import pytest

from app.assets import asset_folder
from app.cell.parts import Cell
from app.errors import WorldError
from app.judge.truth import TrueDistance
from app.messages import Goal
from app.perception.static_filter import StaticFilter
from app.robot.model import Robot
from app.robot.posture import Posture
from app.world.scene import Scene, find_scene, load_scene
from app.world.world import World
from tests.fakes import first_hits

SHIPPED = sorted(p.stem for p in (asset_folder("static_assets") / "scenes").glob("*.toml"))
FOREARM, WRIST_3 = 3, 6


def begun(name: str, robot: Robot) -> tuple[Scene, World, Posture, TrueDistance]:
    """A shipped scene with the robot in the posture that it begins in."""
    scene = load_scene(find_scene(name))
    posture = robot.posture(robot.home if scene.home is None else scene.home)
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    return scene, World(scene.bodies), posture, truth


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_scene_begins_clear_of_the_arm_and_knows_its_table(name, robot):
    scene, world, posture, truth = begun(name, robot)
    assert scene.name == name and scene.title
    assert {"floor", "table", "pedestal"} <= set(scene.cell.names)
    distance = truth.measure(posture.T_base_link, world, leave_out=["table", "pedestal"])
    assert distance[1:].min() > 0.08
    if scene.goal is not None:
        goal = scene.goal.T_base_tool
        np.testing.assert_allclose(goal[:3, :3], posture.T_base_tool[:3, :3], atol=2e-2)


def test_the_scenes_that_users_name_are_there():
    assert {"cell", "front-panel", "side-panel", "empty", "approach"} <= set(SHIPPED)


def test_front_is_where_the_tool_is_at_home(robot):
    tool = robot.posture(robot.home).T_base_tool[:3, 3]
    assert tool[0] > 0.4
    _, world, _, _ = begun("cell", robot)
    door = next(p for p in world.poses() if p.view.name == "door panel")
    assert door.T_base_body[0, 3] > tool[0]


def test_the_front_plate_stands_040_ahead_of_the_tool_and_before_the_goal(robot):
    scene, world, posture, _ = begun("front-panel", robot)
    tool, goal = posture.T_base_tool[:3, 3], scene.goal.T_base_tool[:3, 3]
    o, d = tool[None], np.array([[1.0, 0.0, 0.0]])
    ahead = float(first_hits(world, o, d)[0])
    assert ahead == pytest.approx(0.40, abs=2e-3)
    assert goal - tool == pytest.approx([ahead + 0.05, 0.0, 0.0], abs=2e-3)
    forearm = -posture.T_base_link[FOREARM, :3, 0]
    assert math.degrees(math.asin(-forearm[2])) >= 60.0


@pytest.mark.parametrize(("name", "side"), [("side-panel", 1.0), ("side-panel-right", -1.0)])
def test_the_side_plate_stands_045_beside_the_forearm_and_before_the_goal(name, side, robot):
    scene, world, posture, truth = begun(name, robot)
    clear = truth.measure(posture.T_base_link, world, leave_out=["floor", "table", "pedestal"])
    assert clear[FOREARM] == pytest.approx(0.45, abs=5e-3)
    plate = next(p for p in world.poses() if p.view.name == "plate")
    assert abs(plate.T_base_body[1, 2]) == pytest.approx(1.0)
    near = plate.T_base_body[1, 3] - side * 0.005
    assert side * (scene.goal.T_base_tool[1, 3] - near) == pytest.approx(0.05, abs=1e-3)


def test_the_approaching_person_stops_015_short_of_where_the_arm_was(robot):
    _, world, posture, truth = begun("approach", robot)
    closest = []
    for t in np.arange(0.0, 10.0, 0.1):
        world.step(float(t))
        clear = truth.measure(posture.T_base_link, world, ["floor", "table", "pedestal"])
        closest.append(clear[1:].min())
    assert max(closest) > 1.2
    assert min(closest) == pytest.approx(0.15, abs=0.02)


def test_the_person_of_the_cell_commutes_on_the_left_and_never_walks_into_things(robot):
    scene, world, _, _ = begun("cell", robot)
    parts = [b for b in scene.bodies if "/" in b.name]
    truth = TrueDistance([(b.shape.vertices, b.shape.faces) for b in parts])
    chest = []
    for t in np.arange(0.0, 12.0, 0.2):
        world.step(float(t))
        posed = {p.view.name: p.T_base_body for p in world.poses()}
        chest.append(posed["person/chest"][:2, 3])
        T = np.array([posed[b.name] for b in parts])
        others = [b.name for b in parts] + ["floor"]
        assert truth.measure(T, world, leave_out=others).min() > 0.0
    x, y = np.array(chest).T
    assert y.min() >= 0.55 and y.max() <= 0.80
    assert x.min() < -0.10 and x.max() > 0.55


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_operator_of_the_paper_s_cell_walks_into_nothing_but_may_brush_it(side):
    lean = []
    for seed in (0, 3):
        scene = load_scene(find_scene(f"cell-{side}"), seed)
        world, parts = World(scene.bodies), [b for b in scene.bodies if "/" in b.name]
        truth = TrueDistance([(b.shape.vertices, b.shape.faces) for b in parts])
        own = [b.name for b in parts]
        for t in np.arange(0.0, 40.0, 1.0):
            world.step(float(t))
            posed = {p.view.name: p.T_base_body for p in world.poses()}
            lean.append(posed["operator/chest"][2, 2])
            T = np.array([posed[name] for name in own])
            clear = truth.measure(T, world, leave_out=[*own, "floor"])
            limbs = np.array(["left" in name or "right" in name for name in own])
            assert clear[~limbs].min() > 0.0 and clear[limbs].min() > -0.03
    assert min(lean) < 0.985  # it bows over the table


def test_a_seed_varies_the_person_and_nothing_else():
    a, b, again = (World(load_scene(find_scene("cell"), seed=s).bodies) for s in (1, 2, 1))
    for p, q, r in zip(a.poses(), b.poses(), again.poses(), strict=True):
        assert np.array_equal(p.T_base_body, r.T_base_body)
        assert np.array_equal(p.T_base_body, q.T_base_body) != p.view.name.startswith("person/")


def test_the_surface_of_a_static_body_lies_in_its_box_of_the_cell():
    scene = load_scene(find_scene("cell"))
    named = {p.view.name: p for p in World(scene.bodies).poses()}
    for box in scene.cell.boxes:
        posed = named[box.name]
        T = posed.T_base_body
        surface = posed.view.vertices @ T[:3, :3].T + T[:3, 3]
        assert StaticFilter(Cell(boxes=(box,))).inside(surface).all()
        margin = (box.size - np.ptp(posed.view.vertices, axis=0)) / 2
        assert margin == pytest.approx(np.full(3, margin[0])) and 0.03 < margin[0] < 0.21
        assert not posed.view.movable


def test_a_scene_is_found_by_path_and_an_unknown_name_lists_the_known(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('title = "Mine"')
    assert find_scene(str(path)) == path
    scene = load_scene(path)
    assert (scene.name, scene.bodies, scene.goal, scene.home) == ("mine", (), None, None)
    with pytest.raises(WorldError, match=r"'cel'.*did you mean 'cell'\? known: .*empty"):
        find_scene("cel")


def test_a_whole_scene_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("""
        title = "Mine"
        home_deg = [0, 90]
        goal = { position_m = [1, 0, 0.5], rpy_deg = [180, 0, 0] }
        [[body]]
        name = "ball"
        colour = "#ff8000"
        shape = { kind = "sphere", radius_m = 0.1 }
        position_m = [1, 0, 0]
        motion = { kind = "waypoints", points_m = [[2, 0, 0], [2, 1, 0]], speed_mps = 1 }
        [[body]]
        name = "moon"
        shape = { kind = "sphere", radius_m = 0.1 }
        [body.motion]
        kind = "circle"
        centre_m = [0, 0, 1]
        axis = [0, 0, 2]
        radius_m = 2
        period_s = 4
        [[crop]]
        name = "corner"
        position_m = [0, 1, 0]
        size_m = [1, 2, 3]
        """)
    scene = load_scene(path)
    assert scene.home == pytest.approx([0.0, np.pi / 2])
    assert isinstance(scene.goal, Goal)
    assert np.diag(scene.goal.T_base_tool) == pytest.approx([1, -1, -1, 1])
    assert [(b.name, *b.size) for b in scene.cell.boxes] == [("corner", 1, 2, 3)]
    world = World(scene.bodies)
    ball, moon = world.poses()
    assert ball.view.colour == (255, 128, 0) and ball.view.movable
    assert np.hypot(*moon.T_base_body[:2, 3]) == pytest.approx(2.0)
    world.step(1e-9 + scene.bodies[0].motion.route.starts[2])
    assert world.poses()[0].T_base_body[:3, 3] == pytest.approx([2, 0, 0], abs=1e-6)


BALL = 'name = "ball"\nshape = { kind = "sphere", radius_m = 0.1 }\n'
ANN = '[[person]]\nname = "ann"\nspeed_mps = 1\n'


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", ["key 'title' is missing"]),
        ("title = ", ["not valid TOML"]),
        ("title = 3", ["title = 3", "text"]),
        ('title = "t"\n[[bdoy]]', ["unknown key 'bdoy'", "'body'"]),
        ("[[body]]\nmargin_m = 1", ["body 1", "'name' is missing"]),
        ('[[body]]\nname = ""', ["body 1", "name = ''", "a text"]),
        ("body = 3", ["body = 3", "a list"]),
        ("body = [3]", ["body 1 = 3", "a table with name, shape"]),
        ('[[body]]\nname = "a"', ["body 'a'", "'shape' is missing"]),
        (f"[[body]]\n{BALL}[[body]]\n{BALL}", ["'ball' comes twice"]),
        (f"[[body]]\n{BALL}color = 1", ["body 'ball'", "'color'", "did you mean 'colour'"]),
        (f'[[body]]\n{BALL}colour = "red"', ["body 'ball'", "colour = 'red'", "#rrggbb"]),
        (f"[[body]]\n{BALL}position_m = [1, 2]", ["body 'ball'", "position_m", "3 finite"]),
        (f"[[body]]\n{BALL}position_m = [1, 2, nan]", ["body 'ball'", "position_m"]),
        (f'[[body]]\n{BALL}static = "yes"', ["body 'ball'", "static", "true or false"]),
        (f"[[body]]\n{BALL}static = true\nmovable = true", ["movable", "leave one out"]),
        (f"[[body]]\n{BALL}static = true\nmargin_m = -1", ["margin_m = -1"]),
        (f"[[body]]\n{BALL}motion = 3", ["motion = 3", "table"]),
        (f'[[body]]\n{BALL}motion = {{ kind = "lien" }}', ["motion", "did you mean 'line'"]),
        (
            f'[[body]]\n{BALL}motion = {{ kind = "line", to_m = [1, 0, 0], speed_mps = 0 }}',
            ["body 'ball'", "speed_mps = 0", "above zero"],
        ),
        (
            f'[[body]]\n{BALL}motion = {{ kind = "line", to_m = [0, 0, 0], speed_mps = 1 }}',
            ["body 'ball'", "same point"],
        ),
        (
            f'[[body]]\n{BALL}motion = {{ kind = "waypoints", points_m = [1], speed_mps = 1 }}',
            ["body 'ball'", "points_m[0]"],
        ),
        (
            f'[[body]]\n{BALL}motion = {{ kind = "waypoints", points_m = [], speed_mps = 1 }}',
            ["body 'ball'", "nowhere to go"],
        ),
        (
            f'[[body]]\n{BALL}motion = {{ kind = "circle", centre_m = [0, 0, 0], '
            "axis = [0, 0, 0], radius_m = 1, period_s = 1 }",
            ["body 'ball'", "axis"],
        ),
        (f"{ANN}stops = [3]", ["person 'ann'", "stop 1", "at_m"]),
        (f"{ANN}stops = [{{ at_m = [0, 0] }}]", ["person 'ann'", "nowhere to go"]),
        (f"{ANN}stops = [{{ at_m = [0, 0, 0] }}]", ["stop 1", "2 finite numbers"]),
        (f"{ANN}stops = [{{ at_m = [0, 0], reach_m = [1, 1, 1] }}]", ["dwell_s = 0", "2.4 s"]),
        (
            f'{ANN}hand = "both"\nstops = [{{ at_m = [0, 0] }}, {{ at_m = [1, 0] }}]',
            ["person 'ann'", "hand = 'both'"],
        ),
        (
            f"{ANN}seed = -1\nstops = [{{ at_m = [0, 0] }}, {{ at_m = [1, 0] }}]",
            ["person 'ann'", "seed = -1"],
        ),
        ('[[crop]]\nname = "c"\nsize_m = [1, 1, 0]', ["crop 'c'", "size_m", "above zero"]),
        ("goal = 3", ["goal = 3"]),
        ("[goal]\nrpy_deg = [0, 0, 0]", ["goal", "'position_m' is missing"]),
        ("home_deg = []", ["home_deg is empty"]),
        ('home_deg = [0, "1"]', ["home_deg", "2 finite numbers"]),
        ('[[body]]\nname = "p"\nshape = { kind = "egg" }', ["body 'p'", "'egg'", "sphere"]),
    ],
)
def test_a_bad_scene_is_told_in_one_line_with_file_entry_and_key(content, told, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(content if "title" in content or not content else f'title = "t"\n{content}')
    with pytest.raises(WorldError) as e:
        load_scene(path)
    for part in ["bad.toml", *told]:
        assert part in str(e.value)
    assert "\n" not in str(e.value)


def test_a_missing_scene_file_and_a_body_named_like_a_person_are_told(tmp_path):
    with pytest.raises(WorldError, match=r"none\.toml"):
        load_scene(tmp_path / "none.toml")
    path = tmp_path / "both.toml"
    path.write_text(
        f'title = "t"\n[[body]]\n{BALL.replace("ball", "ann/head")}\n'
        f"{ANN}stops = [{{ at_m = [0, 0] }}, {{ at_m = [1, 0] }}]"
    )
    scene = load_scene(path)
    with pytest.raises(WorldError, match="two bodies are called 'ann/head'"):
        World(scene.bodies)
