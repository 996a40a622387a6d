"""Coverage on the page: a look in a process of its own, colours, and words."""

import numpy as np
import pytest

from app.coverage.beside import Asked, Beside, Seen, Ways, seen_of
from app.coverage.look import look, subject_of
from app.ui.colours import ALARM
from app.ui.scene.coverage_view import FAR_COLOUR, NEAR_COLOUR, colours_of, patch_words, words_of


@pytest.fixture(scope="module")
def subject(robot, skin):
    return subject_of(robot, skin, 300)


@pytest.fixture(scope="module")
def home(robot, subject):
    return look(subject, robot.posture(robot.home))


def asked(robot, working, patch=-1) -> Asked:
    return Asked(np.array(robot.posture(robot.home).T_base_link), working, patch)


def test_sensors_that_cannot_see_cost_what_they_alone_saw_in_time(robot, subject, skin, home):
    everyone, some = np.ones(skin.count, bool), np.arange(skin.count) >= 10
    all_of_it = seen_of(subject, home, asked(robot, everyone))
    fewer = seen_of(subject, home, asked(robot, some))
    nobody = seen_of(subject, home, asked(robot, ~everyone))
    assert all_of_it.lost == 0.0 and nobody.whole == 0.0
    assert fewer.whole + fewer.lost == pytest.approx(all_of_it.whole)
    assert nobody.lost == pytest.approx(all_of_it.whole)
    assert (nobody.gap[np.isfinite(nobody.gap)] == 0.0).all()


def test_a_patch_names_who_sees_first_and_on_how_many_ways(robot, subject, skin, home):
    everyone = np.ones(skin.count, bool)
    patch = int((home.gap > 0.3).any(axis=0).sum(axis=1).argmax())
    ways = seen_of(subject, home, asked(robot, everyone, patch)).ways
    assert ways.patch == patch and ways.open == (~home.barred[patch]).sum()
    best = home.gap[:, patch][:, ~home.barred[patch]]
    assert sum(n for _, n, _ in ways.first) == (best.max(axis=0) > 0.0).sum()
    k, _, far = ways.first[0]
    assert far == pytest.approx(best[k][best.argmax(axis=0) == k].max())


def test_the_process_answers_one_question_at_a_time_and_says_why_it_failed(
    robot, subject, skin, home
):
    beside, question = Beside(subject), asked(robot, np.ones(skin.count, bool), 7)
    try:
        assert beside.ask(question) and not beside.ask(question)
        beside._line.poll(120)  # the first look may have to compile
        answer, here = beside.answer(), seen_of(subject, home, question)
        assert np.array_equal(answer.gap, here.gap, equal_nan=True)
        assert answer.whole == here.whole and answer.ways == here.ways
        assert beside.answer() is None
        beside.ask(Asked(np.zeros((1, 4, 4)), np.ones(1, bool)))
        beside._line.poll(120)
        with pytest.raises(RuntimeError, match="IndexError"):
            beside.answer()
        assert beside._process is None  # the next question begins it anew
    finally:
        beside.close()


def test_colours_go_from_late_to_far_out_and_unseen_is_alarm():
    colours = colours_of(np.array([np.nan, 0.0, 0.03, 0.4, 2.0]))
    assert colours[0].tolist() == NEAR_COLOUR.astype(int).tolist()
    assert colours[1].tolist() == list(ALARM)
    assert colours[3].tolist() == colours[4].tolist() == FAR_COLOUR.astype(int).tolist()


def test_the_words_name_the_worst_link_first_and_what_dead_sensors_cost():
    seen = Seen(np.zeros(1), np.array([0.9, np.nan, 0.25]), 0.6, 0.123)
    words = words_of(seen, ["wrist 3", "base", "upper arm"])
    assert words.startswith("**60 %**") and "**12.3** points" in words
    assert words.endswith("upper arm 25 %, wrist 3 90 %")


def test_the_words_of_a_patch_tell_who_sees_it_and_on_how_many_ways_nobody_does():
    words = patch_words(Ways(3, 19, ((0, 7, 0.31), (1, 2, 0.12))), "upper arm", ["a-01", "a-02"])
    assert words == (
        "Here on the upper arm, of 19 ways: seen first by a-01 from 31 cm (7), a-02 from 12 cm "
        "(2); unseen on 10."
    )
    assert "by nobody; unseen on 4" in patch_words(Ways(0, 4, ()), "elbow", [])
    assert "in every way" in patch_words(Ways(0, 0, ()), "elbow", [])
