"""What is tried is named by what can be typed."""

import pytest

from app.errors import ConfigError
from app.sensing.budget import read_budget
from app.studies.conditions import read_condition


def test_a_condition_is_a_controller_a_side_and_what_is_changed():
    right = read_condition("SR")
    assert (right.name, right.mode, right.side) == ("SR", "sm", "right")
    assert read_condition("paperL").params().memory is False
    assert read_condition("WB", sides=False).side == ""
    alone = read_condition("QP alone")
    assert alone.alone and alone.mode == "qp" and alone.side == ""
    much = read_condition("QPL-memory-speed+dead:3+set:distance_kept=0.2+skin:forearm")
    params = much.params()
    assert not params.memory and not params.obstacle_speed and params.distance_kept == 0.2
    assert (much.fault, much.failing, much.skin) == ("dead", 3, "forearm")


def test_the_oracle_is_told_the_truth_of_the_same_arm():
    budget = read_budget(read_condition("oracleL").budget("honest,body=2"))
    assert budget.ranges == 0.0 and budget.body == budget.kinematics == 1.0
    calibrated = read_budget(read_condition("QPL+calibrated").budget("honest,body=2"))
    assert calibrated.mounting == 0.35 and calibrated.body == 2.0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("WLB", "no condition 'WLB'; .*known: .*WBL"),
        ("smL", "known: .*SL"),
        ("QP", "did you mean"),
        ("QPL-eyes", "nothing to leave out; known: memory, speed"),
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
