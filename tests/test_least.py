"""The least true distance of a run, judged by measuring every link at every moment."""

import numpy as np

from app.judge.least import LeastDistance
from app.judge.truth import TrueDistance
from app.studies.random_scene import random_world
from app.world.world import World


def test_the_least_distance_is_exact_though_few_pairs_are_measured(robot, monkeypatch):
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    moving = np.flatnonzero(robot.supports.any(axis=1))
    pair, measured = truth.pair, []
    monkeypatch.setattr(truth, "pair", lambda *a: measured.append(a) or pair(*a))
    touched = all_pairs = 0
    for seed in range(6):
        rng = np.random.default_rng([seed, 1])
        world = random_world(robot, truth, rng)
        watch, least = LeastDistance(truth, robot, moving, world), np.inf
        q, qd = robot.home.copy(), rng.uniform(-1.0, 1.0, robot.n)
        for i in range(120):
            qd = np.clip(qd + rng.normal(0.0, 0.1, robot.n), -1.0, 1.0)
            q = np.clip(q + 0.02 * qd, robot.q_min, robot.q_max)
            world.step(0.02 * i)
            T = robot.posture(q).T_base_link
            least = min(least, float(truth.measure(T, world)[moving].min()))
            assert watch.update(T, world.poses()) == least
            all_pairs += len(moving) * len(world.poses())
        touched += least <= 0.0
    assert 0 < touched < 6
    assert len(measured) < 0.1 * all_pairs


def test_without_any_body_nothing_is_near(robot):
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    watch = LeastDistance(truth, robot, np.array([3]), World([]))
    assert watch.update(robot.posture(robot.home).T_base_link, ()) == np.inf
