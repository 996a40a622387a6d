"""The truth that is drawn from the error budget: as large as it says, and nothing else moves."""

from dataclasses import fields, replace

import numpy as np
import pytest

from app.errors import ConfigError
from app.robot.arm import SimulatedArm
from app.sensing.budget import HONEST, IDEAL, Budget, read_budget
from app.sensing.simulated import SimulatedSkin
from app.sensing.truth import draw_truth
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine
from app.world.world import World


def off(robot, skin, budget, seeds):
    """Position [m] and angle [degrees] errors of all sensors, (n, 3) each, over seeds."""
    moved, turned = [], []
    for seed in range(seeds):
        true = draw_truth(robot, skin, budget, seed).skin
        for a, b in zip(skin.sensors, true.sensors, strict=True):
            T = np.linalg.inv(a.T_link_sensor) @ b.T_link_sensor
            moved.append(T[:3, 3])
            R = T[:3, :3]  # of a small angle
            turned.append(np.degrees([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2)
    return np.array(moved), np.array(turned)


def test_sensors_are_off_by_two_millimetres_and_half_a_degree(robot, skin):
    moved, turned = off(robot, skin, replace(IDEAL, mounting=1.0), 40)
    assert np.std(moved, axis=0) == pytest.approx(np.full(3, 0.002), rel=0.1)
    assert np.std(turned, axis=0) == pytest.approx(np.full(3, 0.5), rel=0.1)
    assert np.abs(moved.mean(axis=0)).max() < 2e-4 and np.abs(turned.mean(axis=0)).max() < 0.05


def test_twice_the_strength_is_twice_the_error(robot, skin):
    one, two = (off(robot, skin, replace(IDEAL, mounting=m), 1)[0] for m in (1.0, 2.0))
    assert two == pytest.approx(2.0 * one)


def test_the_joints_lie_where_a_calibration_would_find_them(robot, skin):
    budget, moved = replace(IDEAL, kinematics=1.0), []
    for seed in range(30):
        true = draw_truth(robot, skin, budget, seed).robot
        for q in (robot.home, robot.home + 0.7):
            T = np.linalg.inv(robot.posture(q).T_base_tool) @ true.posture(q).T_base_tool
            moved.append(np.linalg.norm(T[:3, 3]))
    assert 0.001 < np.median(moved) < 0.005  # of an arm of 1.3 m: a few millimetres
    assert draw_truth(robot, skin, budget, 3).skin is skin


def test_an_ideal_world_is_the_one_that_is_believed(robot, skin):
    truth = draw_truth(robot, skin, IDEAL, 7)
    assert truth.robot is robot and truth.skin is skin and truth.laid_out is skin


def test_the_same_seed_draws_the_same_truth_and_another_one_does_not(robot, skin):
    a, b, c = (draw_truth(robot, skin, HONEST, s).skin.origin for s in (1, 1, 2))
    assert np.array_equal(a, b) and not np.array_equal(a, c)


def test_a_part_that_is_switched_off_leaves_the_others_as_they_were(robot, skin):
    for f in fields(Budget):
        if f.name == "sub":
            continue
        one_less = replace(HONEST, **{f.name: getattr(IDEAL, f.name)})
        with_it, without = (draw_truth(robot, skin, b, 5) for b in (HONEST, one_less))
        if f.name != "mounting":
            assert np.array_equal(with_it.skin.origin, without.skin.origin), f.name
        if f.name != "kinematics":
            poses = [t.robot.posture(robot.home).T_base_link for t in (with_it, without)]
            assert np.array_equal(*poses), f.name
        if f.name not in ("body", "mounting"):  # a hose keeps out of views
            surfaces = [t.robot.bodies[3].vertices for t in (with_it, without)]
            assert np.array_equal(*surfaces), f.name


@pytest.mark.parametrize(("world", "least", "most"), [("ideal", 0.0, 0.0), ("honest", 3e-4, 0.01)])
def test_a_simulated_plant_tells_judges_where_the_arm_truly_is(world, least, most):
    engine = build_engine(Setup(scene="empty", world=world), ManualClock())
    believed = engine.step().T_base_link
    off = np.linalg.norm((engine.plant.true_poses() - believed)[:, :3, 3], axis=1)
    assert least <= off.max() <= most
    same = [a is b for a, b in zip(engine.plant.robot.bodies, engine.robot.bodies, strict=True)]
    assert all(same) == (world == "ideal")
    engine.close()


def test_encoders_say_the_same_whenever_they_are_asked_at_one_time(robot):
    arm = SimulatedArm(robot, noise=1e-4, seed=3)
    read = np.array([arm.state(0.004 * i).q for i in range(2000)])
    assert np.std(read - arm.q, axis=0) == pytest.approx(np.full(robot.n, 1e-4), rel=0.1)
    assert np.array_equal(arm.state(9.0).q, arm.state(9.0).q)
    assert np.array_equal(SimulatedArm(robot).state(0.0).q, robot.home)


def test_the_links_surfaces_are_a_millimetre_or_two_off_but_for_printed_covers(robot, skin):
    off = [[], []]
    for seed in range(3):
        true = draw_truth(robot, skin, HONEST, seed).robot
        for link, a, b in zip(robot.links, robot.bodies, true.bodies, strict=True):
            moved = np.linalg.norm(b.vertices[: len(a.vertices)] - a.vertices, axis=1)
            off[link in robot.covers].append(np.sqrt(np.mean(moved**2)))
    assert np.mean(off[False]) == pytest.approx(0.0015, rel=0.15) and max(off[True]) == 0.0


def test_a_hose_lies_on_long_links_where_no_sensor_of_theirs_sees_it(robot, skin):
    true = draw_truth(robot, skin, replace(IDEAL, body=1.0), 2).robot
    hosed = [
        link for link, a, b in zip(robot.links, robot.bodies, true.bodies, strict=True)
        if len(b.faces) > len(a.faces)
    ]  # fmt: skip
    assert hosed == ["upper_arm_link", "forearm_link"]
    i = robot.link_index("forearm_link")
    hose = true.bodies[i].vertices[len(robot.bodies[i].vertices) :]
    for k in range(skin.count):
        to = hose - skin.origin[k]
        inside = to @ skin.axis[k] > np.cos(np.radians(22.5)) * np.linalg.norm(to, axis=1)
        assert not inside.any()


def test_a_window_moves_with_its_sensor_so_that_no_sensor_looks_into_its_own_cover(robot, skin):
    budget = replace(IDEAL, mounting=2.0, body=1.0)
    eye = SimulatedSkin(robot, skin, World(()), 1, budget=budget)
    as_laid_out = SimulatedSkin(robot, skin, World(()), 1)
    posture = robot.posture(robot.home)
    covers = [robot.link_index(name) for name in robot.covers]
    for k in range(skin.count):
        own = np.isin(eye.read(k, posture).label, covers)
        assert np.array_equal(own, np.isin(as_laid_out.read(k, posture).label, covers))


def stamped(robot, skin, **parts):
    """Frames of two seconds by sensor and number: stamp, and how much later it came [s]."""
    eye = SimulatedSkin(robot, skin, World(()), 2, budget=replace(IDEAL, **parts))
    posture = robot.posture(robot.home)
    seen = [(f, t) for t in np.arange(0.0, 2.0, 0.002) for f in eye.poll(t, posture)]
    stamp = {(f.sensor, f.sequence): f.stamp for f, _ in seen}
    return stamp, np.array([t - f.stamp for f, t in seen])


def test_stamps_are_late_by_a_constant_and_jitter(robot, skin):
    right, on_time = stamped(robot, skin)
    wrong, late = stamped(robot, skin, time=1.0, late_ms=30.0)
    off = np.array([wrong[key] - right[key] for key in wrong])
    assert off.mean() == pytest.approx(0.030, abs=5e-4)
    assert off.std() == pytest.approx(0.002, rel=0.1)
    assert late.min() > 0.0 and on_time.min() > 0.049


def test_no_frame_is_stamped_later_than_it_arrives(robot, skin):
    _, late = stamped(robot, skin, time=3.0, late_ms=60.0)
    assert late.min() >= -1e-9  # it arrives later then


def test_a_text_names_a_world_and_its_parts():
    assert read_budget("honest") == HONEST and read_budget("ideal") == IDEAL
    assert read_budget("honest,mounting=0,time=2") == replace(HONEST, mounting=0.0, time=2.0)
    assert read_budget("ideal,sub=7,late_ms=30") == replace(IDEAL, sub=7, late_ms=30.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("perfect", "begins with no world"),
        ("honest,mountign=1", "did you mean 'mounting'"),
        ("honest,time=much", "give time=NUMBER"),
        ("honest,time=-1", "give 0 to 100"),
        ("honest,sub=99", "give 3 to 15"),
    ],
)
def test_a_text_that_means_no_world_says_what_would(text, words):
    with pytest.raises(ConfigError, match=words):
        read_budget(text)
