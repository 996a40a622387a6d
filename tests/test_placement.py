"""`flinch place`: rings where they see most, as a layout that can be printed, loaded and run."""

import itertools
import json

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from app.choices import build_robot, build_robot_and_skin
from app.cli import main
from app.coverage.choosing import Problem, bound, choose, value
from app.coverage.look import look, subject_of
from app.coverage.sites import WIDTH, clashes, parse_keep_out, places, rings_at, round_links
from app.coverage.worth import STEPS, weights, worths
from app.errors import ConfigError, RobotError
from app.setup import Setup
from app.studies.coverage.placement import Wanted, candidates_for, place, problem_of

BARE = Setup(robot="ur10e", skin="none")
SMALL = Wanted(BARE, 10, counts=(5,), tilts=(0.0,), patches=60, keep_out=(parse_keep_out(
    "upper_arm_link:0:0.3"),))  # fmt: skip


@pytest.fixture(scope="module")
def bare():
    return build_robot(BARE)


def problem(seed: int, count: int = 8, ways: int = 12) -> Problem:
    rng = np.random.default_rng(seed)
    worth = rng.integers(0, STEPS + 1, (count, ways)).astype(np.uint8)
    clash = np.triu(rng.random((count, count)) < 0.2, 1)
    return Problem(
        worth, rng.random(ways).astype(np.float32), rng.integers(1, 5, count),
        clash | clash.T | np.eye(count, dtype=bool),
    )  # fmt: skip


def best_by_trying_all(p: Problem, budget: int) -> float:
    best = 0.0
    for n in range(len(p.cost) + 1):
        for s in map(list, itertools.combinations(range(len(p.cost)), n)):
            free = p.clash[np.ix_(s, s)].sum() == len(s)
            if free and p.cost[s].sum() <= budget:
                best = max(best, value(p, s))
    return best


@given(st.integers(0, 10_000), st.integers(1, 12))
def test_a_choice_fits_and_lies_between_what_theory_promises_and_the_bound(seed, budget):
    p = problem(seed)
    choice, best = choose(p, budget), best_by_trying_all(p, budget)
    taken = list(choice.taken)
    assert p.cost[taken].sum() <= budget
    assert p.clash[np.ix_(taken, taken)].sum() == len(taken)
    assert choice.value <= best + 1e-6 <= choice.bound + 1e-5
    assert choice.value >= 0.5 * best - 1e-6


@given(st.integers(0, 10_000))
def test_more_sensors_are_never_worth_less(seed):
    p = problem(seed)
    rng = np.random.default_rng(seed)
    few = [r for r in range(len(p.cost)) if rng.random() < 0.4]
    assert value(p, sorted({*few, int(rng.integers(len(p.cost)))})) >= value(p, few)
    assert bound(p, few, 3) >= value(p, few)


@pytest.fixture(scope="module")
def forearm(bare):
    return places(bare, ("forearm_link",))


def test_a_ring_goes_where_a_link_is_round_for_its_cover(bare):
    found = places(bare)
    assert {p.link for p in found} == {"upper_arm_link", "forearm_link"}
    known = round_links(bare)
    for p in found:
        assert WIDTH / 2 <= p.along <= known[p.link].length - WIDTH / 2 + 1e-9


def test_nothing_goes_where_it_is_kept_out(bare):
    out = parse_keep_out("forearm_link:0.1:0.2")
    for p in places(bare, ("forearm_link",), (out,)):
        assert p.along + WIDTH / 2 <= 0.1 + 1e-9 or p.along - WIDTH / 2 >= 0.2 - 1e-9
    with pytest.raises(RobotError, match="no place"):
        places(bare, ("forearm_link",), (parse_keep_out("forearm_link"),))


@pytest.mark.parametrize("text", ["", "a:1", "a:2:1", "a:x:y", "a:-1:2"])
def test_what_is_no_keep_out_says_how_to_write_one(text):
    with pytest.raises(RobotError, match="LINK:FROM:TO"):
        parse_keep_out(text)


def test_covers_that_would_overlap_clash(forearm):
    close = clashes(forearm)
    assert close.diagonal().all() and close[0, 1] and not close[0, 2]


def test_the_worth_of_a_gap_grows_to_the_horizon_and_no_further():
    gap = np.array([0.0, 0.1, 0.2, 0.4, 1.0], dtype=np.float32)
    assert worths(gap, 0.4).tolist() == [0, 62, 125, 250, 250]


def test_what_no_joint_moves_and_what_comes_from_the_floor_weighs_nothing(robot, skin):
    subject = subject_of(robot, skin, 200)
    posture = robot.posture(robot.home)
    seen = look(subject, posture)
    weight = weights(subject, posture, seen.at, seen.barred)
    base = ~robot.supports.any(axis=1)[subject.patches.link]
    assert base.any() and (weight[base] == 0.0).all()
    below = seen.at.point[..., 2][:, None] + 0.5 * seen.at.direction[..., 2] < 0.0
    assert (weight[below] == 0.0).all() and (weight[seen.barred] == 0.0).all()
    assert weight.max() > 0.0


@pytest.mark.slow
def test_a_placement_is_the_same_on_one_process_and_two(bare):
    q = np.array([bare.home, bare.home + 0.3])
    one, two = problem_of(SMALL, q), problem_of(SMALL, q, jobs=2)
    assert np.array_equal(one.worth, two.worth) and np.array_equal(one.weight, two.weight)
    assert sum(r.count for r in place(SMALL, one, 10).rings) <= 10


def test_a_candidate_is_judged_as_its_own_layout_would_be(bare):
    """The worth of one ring is that of a skin of this ring alone on the bare arm."""
    from app.robot.skin import build_skin
    from app.robot.skin_file import ring_sensors
    from app.studies.coverage.placement import Task, part_of

    part, c = part_of(Task(SMALL, 0, bare.home)), candidates_for(SMALL)
    chosen = len(c.rings) // 2
    skin = build_skin("one", tuple(ring_sensors(c.rings[chosen], c.type, "")), bare)
    seen = look(subject_of(bare, skin, SMALL.patches), bare.posture(bare.home))
    assert np.array_equal(part.worth[chosen], worths(seen.gap.max(axis=0)).ravel())


def test_what_the_ports_cannot_carry_is_refused_before_anything_is_looked_at():
    with pytest.raises(ConfigError, match=r"more --ports"):
        candidates_for(Wanted(BARE, 30, baud=115_200))


def test_fewer_sensors_than_a_ring_are_refused():
    with pytest.raises(ConfigError, match="give 4 or more"):
        candidates_for(Wanted(BARE, 3))


def test_rings_of_all_counts_and_tilts_are_tried_at_two_turns(forearm):
    rings = rings_at(forearm[0], (4, 6), (0.0, 20.0))
    assert len(rings) == len(set(rings)) == 8


def test_a_placed_layout_is_loaded_run_and_printed(tmp_path, capsys):
    out = tmp_path / "placed"
    args = ["--sweep", "4", "8", "--counts", "4", "--tilts", "0", "20", "--postures", "grid:2"]
    where = ["--links", "forearm_link", "--out", str(out)]
    assert main(["place", *args, *where, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    few, many = (r for r in report["rows"] if r["name"].startswith("placed-"))
    assert (few["sensors"], many["sensors"]) == (4, 8)
    assert 0.0 < few["worth_chosen_on"] <= many["worth_chosen_on"] <= 1.0
    for name in ("placed-8.toml", "layout.toml"):
        _, skin = build_robot_and_skin(Setup(robot="ur10e", skin=str(out / name)))
        assert skin.count in (4, 8)
    assert (out / "place.png").stat().st_size > 1000
    prints = sorted(out.glob("cover-*.stl"))
    assert len(prints) == skin.count / 4
    for path in prints:
        mesh = trimesh.load(path)
        assert mesh.is_watertight and 30.0 < np.ptp(mesh.vertices[:, 2]) < 60.0


@pytest.mark.parametrize(
    "args", [["--sensors", "0"], ["--horizon", "9"], ["--tilts", "95"], ["--postures", "home"]]
)
def test_what_cannot_be_placed_is_refused_in_one_line(args, capsys):
    assert main(["place", *args]) == 1
    assert capsys.readouterr().err.count("\n") == 1
