"""Trials on many processes: the same answers, whatever does them."""

from functools import partial

import pytest

from app.cli import main
from app.errors import ConfigError
from app.studies.bootstrap import bootstrap
from app.studies.experiment import run_spec
from app.studies.experiments.worlds import split
from app.studies.pool import each, shard_of
from app.studies.study import Study, locally, run_study, tell
from app.studies.trial import TrialResult, TrialSpec
from app.studies.world_trial import condition


def test_shards_are_apart_and_leave_nothing_out():
    specs = range(11)
    parts = [shard_of(specs, f"{i}/3") for i in (1, 2, 3)]
    assert sorted(x for part in parts for x in part) == list(specs)
    for wrong in ("0/3", "4/3", "a/b", "1", "-1/2"):
        with pytest.raises(ConfigError, match="give I/N"):
            shard_of(specs, wrong)


def test_several_processes_give_the_results_of_one():
    work, specs = partial(divmod, 1000), range(1, 40)
    assert sorted(each(work, specs, jobs=2)) == sorted(each(work, specs))


def test_a_trial_is_the_same_whatever_was_run_before_it():
    spec, other = TrialSpec("worlds", "QP", 5, 0.4), TrialSpec("worlds", "S", 6, 0.2)
    before = run_spec(spec)
    run_spec(other)
    assert run_spec(spec) == before and not before.fault


@pytest.mark.slow
def test_random_worlds_are_the_same_on_two_processes_and_from_a_log(tmp_path):
    log, study = tmp_path / "trials.jsonl", Study("worlds", trials=2, seconds=0.3)
    alone = tell(study, run_study(study, locally()))
    together = tell(study, run_study(study, locally(2), log))
    assert together.rows == alone.rows and len(log.read_text().splitlines()) == 8
    assert tell(study, run_study(study, locally(), log)).rows == alone.rows


def test_random_worlds_have_neither_sides_nor_faults():
    assert [s.condition for s in Study("worlds", trials=1).specs()] == ["QP", "WB", "S", "oracle"]
    for wrong in ("QP+dead:3", "QP alone", "QPL"):
        with pytest.raises(ConfigError, match="condition"):
            condition(wrong)


def test_what_the_oracle_touches_as_well_is_nobodys_fault():
    unseen, seen, fled = (
        {"cause": cause, "phantom_m": phantom}
        for cause, phantom in (("not seen", 0.0), ("avoidable", 0.05), ("avoidable", 0.2))
    )
    touches = [
        (1, "QP", seen), (1, "oracle", seen), (2, "QP", unseen), (2, "oracle", None),
        (3, "QP", seen), (3, "oracle", None), (4, "QP", None), (4, "oracle", seen),
        (5, "QP", fled), (5, "oracle", None),
    ]  # fmt: skip
    row = split("QP", [TrialResult(seed, name, {"touch": t}) for seed, name, t in touches])
    assert (row["nobody"], row["control"]) == (1, 1)
    assert (row["perception_unseen"], row["perception_phantom"]) == (1, 1)


def test_an_interval_holds_its_mean_and_is_narrow_where_all_agree():
    mean, low, high = bootstrap([0.1, 0.2, 0.3])
    assert mean == pytest.approx(0.2) and 0.1 <= low < 0.2 < high <= 0.3
    assert bootstrap([0.5] * 10) == pytest.approx((0.5, 0.5, 0.5))
    # of a normal variable the interval is the mean's two deviations each way
    wide = bootstrap([-1.0, 1.0] * 200)
    assert wide.high == pytest.approx(1.96 / 20.0, rel=0.1)


def test_numbers_that_make_no_study_are_refused_before_it(capsys):
    assert main(["experiment", "worlds", "--jobs", "0"]) == 1
    assert "must be positive" in capsys.readouterr().err
