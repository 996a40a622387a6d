"""What is tried is named by what can be typed."""

import numpy as np
import pytest

from app.errors import ConfigError
from app.sensing.budget import read_budget
from app.setup import Setup
from app.studies.case import Case, build_case
from app.studies.conditions import read_condition
from app.studies.experiment import experiment_of


def test_a_condition_is_a_controller_a_side_and_what_is_changed():
    right = read_condition("SR")
    assert (right.name, right.mode, right.side) == ("SR", "sm", "right")
    assert read_condition("paperL").params().memory is False
    assert read_condition("WB", sides=False).side == ""
    assert read_condition("QPL+program:door-screws").program == "door-screws"
    alone = read_condition("QP alone")
    assert alone.alone and alone.mode == "qp" and alone.side == ""
    much = read_condition("QPL-memory-speed+dead:3+set:distance_kept=0.2+skin:forearm")
    params = much.params()
    assert not params.memory and not params.obstacle_speed and params.distance_kept == 0.2
    assert (much.fault, much.failing, much.skin) == ("dead", 3, "forearm")
    assert read_condition("QPL-memory+skin:forearm-rings+dead:3").skin == "forearm-rings"


def test_the_oracle_is_told_the_truth_of_the_same_arm():
    budget = read_budget(read_condition("oracleL").budget("honest,body=2"))
    assert budget.ranges == 0.0 and budget.body == budget.kinematics == 1.0
    calibrated = read_budget(read_condition("QPL+calibrated").budget("honest,body=2"))
    assert calibrated.mounting == 0.35 and calibrated.body == 2.0


def test_without_several_pairs_the_programme_is_told_of_one_a_link():
    condition = read_condition("QP-pairs", sides=False)
    assert condition.one_pair
    engine = build_case(Case(Setup(scene="front-panel", rate=125.0), condition.params()), condition)
    try:
        for _ in range(60):
            s = engine.step()
    finally:
        engine.close()
    links = s.pairs.link[np.isfinite(s.pairs.distance)]
    assert len(links) > 2 and len(links) == len(set(links.tolist()))


def test_a_variant_stands_at_the_end_where_an_experiment_has_some():
    slow = read_condition("QP-memory@0.3-by", sides=False, variants=("0.3-by", "1.0"))
    assert slow.variant == "0.3-by" and not slow.params().memory and slow.name.endswith("by")
    for wrong, words in (("QP@0.4", "known: 0.3, 1.0"), ("QP", "give @VARIANT; known")):
        with pytest.raises(ConfigError, match=words):
            read_condition(wrong, sides=False, variants=("0.3", "1.0"))
    with pytest.raises(ConfigError, match="no variants"):
        read_condition("QP@0.3", sides=False)


def test_a_condition_without_its_variant_stands_for_all_of_them():
    front = experiment_of("front-panel")
    assert front.wanted(["QP", "WB@0.55"]) == (
        "QP@0.40", "QP@0.40-on", "QP@0.55", "QP@0.55-on", "WB@0.55",
    )  # fmt: skip
    assert len(front.wanted()) == 4 * len(front.conditions)
    assert experiment_of("hri").wanted(["QPL"]) == ("QPL",)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("WLB", "no condition 'WLB'; .*known: .*WBL"),
        ("smL", "known: .*SL"),
        ("QP", "did you mean"),
        ("QPL-eyes", "nothing to leave out; known: memory, pairs, speed"),
        ("WBL-pairs", "no several pairs"),
        ("oracleL-pairs", "no several pairs"),
        ("QPL+dead", r"'\+dead'; .*dead:SENSORS"),
        ("QPL+dead:0", "dead:SENSORS"),
        ("QPL+set:distance_kept=9", "0.05 to 0.4"),
        ("QPL+set:kept=0.2", "unknown setting 'kept'"),
        ("QPL+world:mount=2", "no part 'mount'"),
    ],
)
def test_a_condition_that_there_is_not_is_refused_with_what_there_is(wrong, words):
    with pytest.raises(ConfigError, match=words):
        read_condition(wrong)
