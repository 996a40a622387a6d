"""The tab of the cell: people, pause, undo, sizes, and what a body in the hand is told of."""

import pickle
from types import SimpleNamespace

import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    MoveObstacle,
    PauseWorld,
    RemoveObstacle,
    SetGoal,
    SetPerson,
    StepWorld,
)
from app.errors import WorldError
from app.messages import BodyPose, Goal
from app.plant.plant import refusal
from app.plant.simulated import SimulatedPlant
from app.poses import transform
from app.robot.arm import SimulatedArm
from app.sensing.source import Unfailing
from app.timing import ManualClock
from app.ui.panels.obstacles_panel import SHAPES, ObstaclesPanel, placed, resized
from app.ui.panels.world_panel import WorldPanel
from app.ui.shelf import Shelf
from app.ui.undo import Undo
from app.world.entries import person_called
from app.world.people import WHO
from app.world.scene import load_scene
from app.world.world import Exchange, World
from tests.ui_page import (  # noqa: F401 - fixtures
    at,
    body,
    run,
    serving,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)


class Nobody(Unfailing):
    """Sensors that never speak."""

    name, connected = "none", np.zeros(30, dtype=bool)

    def poll(self, now, posture):
        return []

    def ended(self):
        return ""


@pytest.fixture
def plant(robot):
    return SimulatedPlant(robot, SimulatedArm(robot), Nobody(), World([]))


def names(plant):
    return {p.view.name for p in plant.bodies()}


@pytest.mark.parametrize("who", WHO)
def test_a_person_comes_walks_and_goes(plant, who):
    assert plant.editable and refusal(plant, SetPerson(who)) == ""
    plant.read(0.0, 0.5)
    before = {p.view.name: p.T_base_body for p in plant.bodies()}
    assert bool(before) == (who != "none") and not any(p.view.movable for p in plant.bodies())
    plant.read(2.5, 0.5)
    moved = [np.abs(p.T_base_body - before[p.view.name]).max() for p in plant.bodies()]
    assert who == "none" or max(moved) > 0.1
    plant.act(AddObstacle("box", {"kind": "box", "size_m": [0.1, 0.1, 0.1]}, (1.0, 0.0, 0.5)))
    plant.act(SetPerson("none"))
    plant.read(2.6, 0.5)
    assert names(plant) == {"box"}  # what a person has put there stays
    assert "works" in refusal(plant, SetPerson("ghost"))


def test_a_copy_of_the_world_in_another_process_follows_people(plant):
    copy, letters = pickle.loads(pickle.dumps(plant.world)), []
    plant.world.follow(lambda edit: letters.append(pickle.dumps(edit)))
    plant.act(SetPerson("works"))
    for letter in letters:
        copy.edit(pickle.loads(letter))
    assert [b.name for b in copy.bodies] == [b.name for b in plant.world.bodies] != []
    with pytest.raises(WorldError, match="two bodies are called"):
        copy.exchange(Exchange((), person_called("works")))


def test_a_paused_world_stands_still_steps_and_goes_on_from_there(plant):
    plant.act(SetPerson("walks"))
    plant.read(0.0, 0.5)
    plant.read(2.0, 0.5)
    assert "pause it first" in refusal(plant, StepWorld(0.1))
    plant.act(PauseWorld(True))
    plant.read(5.0, 0.5)
    assert plant.world.time == 2.0
    plant.act(StepWorld(0.2))
    assert plant.world.time == pytest.approx(2.2)
    assert "give up to 10 s" in refusal(plant, StepWorld(float("nan")))
    plant.act(PauseWorld(True))  # again: nothing
    plant.act(PauseWorld(False))
    plant.read(6.0, 0.5)
    assert plant.world.time == pytest.approx(3.2)


def test_the_buttons_ask_for_people_pause_and_step(page, engine):
    run(page, page.people.person, "works")
    run(page, page.people.pause, True)
    assert not page.people.step.disabled
    run(page, page.people.step, True)
    run(page, page.people.pause, False)
    assert page.people.step.disabled
    assert engine.posted == [
        SetPerson("works"), PauseWorld(True), StepWorld(0.2), PauseWorld(False),
    ]  # fmt: skip


def test_a_real_skin_is_offered_nothing_that_it_cannot_see(engine):
    real = SimpleNamespace(editable=False, post=None)
    with serving(port=0) as server:
        panel = ObstaclesPanel(server, real, ManualClock())
    assert not any(c.visible for c in (panel.add, panel.chosen, panel.size, panel.delete))


def test_a_new_body_stands_beside_the_arm_as_it_is_seen(engine):
    now = snapshot(engine)
    middle = now.T_base_link[:, :3, 3].mean(axis=0)
    eye = middle + np.array([2.0, 0.0, 0.5])
    (add,) = placed("new", dict(SHAPES["Box"]), now, eye)
    away = np.array(add.position) - middle
    assert away[:2] == pytest.approx([0.0, 0.65], abs=1e-9)  # to the right of who looks along -x


def test_a_body_grows_in_its_place_and_keeps_its_name(page, engine):
    page.obstacles._added["ball"] = SHAPES["Sphere"]
    there = at(body("ball"), [0.5, 0.1, 0.4])
    show(page, engine, snapshot(engine, world=(there,)))
    page.obstacles.select("ball")
    run(page, page.obstacles.size, "larger")
    gone, come, moved = engine.posted
    assert gone == RemoveObstacle("ball") and come.shape["radius_m"] == pytest.approx(0.15)
    assert isinstance(moved, MoveObstacle) and come.position == pytest.approx((0.5, 0.1, 0.4))
    assert resized({"kind": "box", "size_m": [0.2, 3.0, 0.005]}, 1.25) == {
        "kind": "box", "size_m": [0.25, 2.0, 0.01],
    }  # fmt: skip


@pytest.fixture
def undo(engine):
    engine.posted.clear()
    return Undo(engine, ManualClock(1.0))


def pose(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_a_whole_drag_is_one_step_back(undo, engine):
    undo.see(snapshot(engine, world=(at(body("ball"), [0.1, 0.0, 0.0]),)))
    for i, x in enumerate((0.2, 0.3, 0.4)):
        undo._clock.t = 1.0 + 0.1 * i
        undo.post(MoveObstacle("ball", pose(x)))
    undo.undo()
    assert engine.posted[-1].T_base_body[0, 3] == 0.1 and len(engine.posted) == 4
    undo.undo()
    assert len(engine.posted) == 4  # there is nothing before it
    undo.redo()
    assert engine.posted[-1].T_base_body[0, 3] == 0.4


def test_a_goal_an_added_and_a_deleted_body_come_back(undo, engine):
    ball = AddObstacle("ball", {"kind": "sphere", "radius_m": 0.1}, (0.1, 0.0, 0.0))
    first = snapshot(engine, goal=Goal(pose(0.7)))
    undo.see(first)
    undo.post(SetGoal(pose(0.9)))
    undo.post(ball)
    undo.see(snapshot(engine, world=(at(body("ball"), [0.5, 0.0, 0.0]),)))
    undo.post(RemoveObstacle("ball"))
    undo.undo()
    again, moved = engine.posted[-2:]
    assert again == ball and moved.T_base_body[0, 3] == 0.5
    undo.undo()
    assert engine.posted[-1] == RemoveObstacle("ball")
    undo.undo()
    assert engine.posted[-1].T_base_tool[0, 3] == 0.7
    for _ in range(4):
        undo.redo()
    assert engine.posted[-1] == RemoveObstacle("ball")
    undo.undo()
    undo.post(SetGoal(pose(0.8)))
    count = len(engine.posted)
    undo.redo()  # something else was done since
    assert len(engine.posted) == count


def test_a_body_in_the_hand_shows_its_distance_and_what_it_stands_above(page, engine):
    there = at(body("ball"), [1.0, 0.3, 0.6])
    show(page, engine, snapshot(engine, world=(there,)))
    assert not page.hand.label.visible
    event = SimpleNamespace(
        client_id=0, phase="start", start_position=(1.0, 0.3, 0.6), end_position=(1.0, 0.3, 0.6),
        modifier=None,
    )  # fmt: skip
    page.world.drag("ball", event)
    show(page, engine, snapshot(engine, world=(there,)))
    assert page.hand.label.visible and page.hand.shadow.visible
    assert page.hand.label.text.split(" cm to the ")[1] in ("wrist 3", "wrist 2", "wrist 1")
    np.testing.assert_allclose(page.hand.line.points[0], [[1.0, 0.3, 0.6], [1.0, 0.3, 0.0]])
    event.phase = "end"
    page.world.drag("ball", event)
    show(page, engine, snapshot(engine, world=(there,)))
    assert not page.hand.label.visible


def test_a_saved_scene_has_what_was_added_and_can_be_run(engine, tmp_path):
    posted = []
    listens = SimpleNamespace(**vars(engine) | {"post": posted.append})
    with serving(port=0) as server:
        undo = Undo(listens, ManualClock(1.0))
        panel = WorldPanel(server, listens, undo, Shelf(tmp_path, "scene"), "empty")
        turned = transform(np.array([0.5, 0.1, 0.4]), np.radians([0.0, 0.0, 30.0]))
        undo.see(snapshot(engine))
        undo.post(AddObstacle('a "box"', dict(SHAPES["Box"]), (0.5, 0.0, 0.4)))
        view = body('a "box"')
        panel.update(snapshot(engine, world=(BodyPose(view, turned),)))
        panel.keep()
    (name,) = panel._shelf.names()
    assert name in posted[-1].words
    scene = load_scene(tmp_path / name)
    (box,) = [b for b in scene.bodies if b.name == 'a "box"']
    np.testing.assert_allclose(box.motion.pose(0.0), turned, atol=1e-4)
    panel._scene = "nowhere"
    panel.keep()
    assert posted[-1].refused and "nowhere" in posted[-1].words
