"""A thing that is seen for a while: where it is, when it is in sight, and what is told of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.control.programs import find_program, load_program
from app.studies.experiment import experiment_of, run_spec
from app.studies.experiments.occlusion import CONDITIONS, NAME, Sight
from app.studies.trial import TrialResult, TrialSpec
from app.world.scene import find_scene, load_scene

OCCLUSION = experiment_of(NAME)


def test_the_ball_lies_on_the_last_of_the_way_and_is_there_before_it():
    scene, program = load_scene(find_scene(NAME)), load_program(find_program(NAME))
    ball = next(b for b in scene.bodies if b.name == "ball")
    way = [w.T_base_tool[:3, 3] for w in program.waypoints]
    assert np.linalg.norm(ball.motion.pose(0.0)[:3, 3] - way[-1]) > 2.0
    away = [np.linalg.norm(ball.motion.pose(2.0)[:3, 3] - w) for w in way]
    assert away[-1] < ball.shape.dims[0] < 0.3 < min(away[:-1])


def snapshot(stamp, seen, remembered):
    vertices, at = np.array([[0.07, 0.0, 0.0]]), np.eye(4)
    ball = SimpleNamespace(view=SimpleNamespace(name="ball", vertices=vertices), T_base_body=at)
    point = np.array([[0.1, 0.0, 0.0]])
    far = np.array([[0.5, 0.0, 0.0]])
    cloud = SimpleNamespace(kept=lambda: point if seen else far)
    memory = point if remembered else np.empty((0, 3))
    return SimpleNamespace(stamp=stamp, world=[ball], cloud=cloud, memory=memory)


def test_what_comes_into_sight_and_leaves_it_is_marked():
    sight = Sight(None)
    for stamp, seen, known in ((0.0, False, False), (1.0, True, False), (2.0, False, True),
                               (3.0, False, True)):  # fmt: skip
        sight.update(snapshot(stamp, seen, known))
    assert sight.marks() == [[1.0, "the ball is seen"], [2.0, "the ball is not seen"]]
    assert sight.figures() == {"in_sight": 0.25, "remembered": 0.5}


def test_what_memory_is_worth_is_told_seed_by_seed():
    figures = {"nearest_link": {"": 1.0}, "goal_error_m": 0.1}
    trials = [
        TrialResult(seed, name, figures | {"least_m": d, "own_contacts": int(d == 0.0)})
        for name, d in zip(CONDITIONS, (0.3, 0.0, 0.0, 0.31, 0.25), strict=True) for seed in (0, 1)
    ]  # fmt: skip
    rows, checks = OCCLUSION.tell(trials)
    worth = next(r for r in rows if r["name"] == "QP-memory - QP, least_m")
    assert worth["mean"] == pytest.approx(-0.3) and worth["n"] == 2
    assert [(c.name, c.ok) for c in checks] == [("QP: moved into", True)]


def test_a_moment_has_its_figures():
    result = run_spec(TrialSpec(NAME, "WB+set:memory=true", 0, 0.4))
    assert not result.fault and result.figures["in_sight"] == 0.0
    assert result.figures["least_m"] > 1.0
