"""Trials give the same whatever runs them, and one that is lost is a row with its cause."""

import subprocess
import sys

import pytest

from app.cli import main
from app.errors import ConfigError
from app.studies.engines import LOST, Means, engine_of
from app.studies.pool import Fate, apart
from app.studies.study import Study
from app.studies.trial import TrialSpec
from app.studies.warm_up import moments, warmed
from tests import toy_trial


def specs(*conditions):
    return [TrialSpec("toy", c, i, 1.0) for i, c in enumerate(conditions)]


def by_condition(run, wanted, trial=toy_trial.run):
    return {spec.condition: result for spec, result in run(trial, wanted)}


def test_several_processes_give_the_results_of_one():
    wanted = specs(*(f"good {i}" for i in range(20)))
    found = by_condition(engine_of("local", Means(jobs=2)), wanted)
    assert repr(sorted(found.items())) == repr(
        sorted((s.condition, toy_trial.run(s)) for s in wanted)
    )


def test_a_process_that_dies_is_tried_once_more_and_then_a_row_with_its_cause(tmp_path):
    wanted = specs("good", "killed", f"once:{tmp_path / 'died'}", "fine")
    found = by_condition(engine_of("local", Means(jobs=2)), wanted)
    assert found["killed"].fault == LOST + "its process died (SIGKILL)"
    assert not any(r.fault for c, r in found.items() if c != "killed") and len(found) == 4


def test_a_trial_that_takes_too_long_is_ended_and_the_next_one_runs():
    found = by_condition(engine_of("local", Means(limit=1.0)), specs("slow:600", "good"))
    assert found["slow:600"].fault == LOST + "it took longer than 1 s"
    assert not found["good"].fault


def test_what_a_trial_raises_is_raised_in_the_study():
    fate = Fate(lambda spec, cause: None, lambda spec: 60.0)
    with pytest.raises(ValueError, match="bad luck"):
        list(apart(toy_trial.run, specs("bad"), 1, fate))


def test_a_trial_may_take_as_long_as_its_length_wants_unless_told_otherwise():
    spec = specs("good")[0]
    assert Means().seconds(spec) < Means().seconds(spec._replace(seconds=60.0))
    assert Means(limit=7.0).seconds(spec) == 7.0


def test_each_controller_is_warmed_up_once_before_the_trials():
    wanted = Study("hri", ("SR", "SL", "WBL", "WBR-memory"), trials=3).specs()
    short = moments(wanted)
    assert len(short) == 2 and {s.seconds for s in short} == {0.3}
    ran = list(warmed(engine_of("local", Means()))(toy_trial.run, specs("good", "fine")))
    assert [spec for spec, _ in ran] == specs("good", "fine")  # nothing of the warm-up


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cloud", "known: local, ray, submitit"),
        ("local:x", "no address"),
        ("submitit", "--out DIR"),
    ],
)
def test_an_engine_that_cannot_be_is_one_line(name, words):
    pytest.importorskip("submitit")
    with pytest.raises(ConfigError, match=words) as told:
        engine_of(name, Means())
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(("name", "extra"), [("ray", "ray"), ("submitit", "cluster")])
def test_a_package_that_is_missing_is_one_line_with_its_remedy(name, extra, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, name, None)
    assert main(["experiment", "hri", "--engine", name, "--trials", "1"]) == 1
    err = capsys.readouterr().err
    assert f"pip install -e '.[{extra}]'" in err and err.count("\n") == 1


def table_of(engine, out):
    """The tables of a short study by an engine, as the command writes them."""
    flags = ["--conditions", "SR,WBL", "--trials", "1", "--seconds", "1", "--seed", "4"]
    command = [sys.executable, "-m", "app", "experiment", "hri", *flags, "--jobs", "2", "--json"]
    done = subprocess.run(
        [*command, "--engine", engine, "--out", str(out)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "fault" not in (out / "table.csv").read_text()
    return [(out / name).read_bytes() for name in ("trials.csv", "table.csv")]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["ray", "submitit:local"])
def test_a_cluster_gives_the_same_bytes_as_this_machine(engine, tmp_path):
    pytest.importorskip(engine.partition(":")[0])
    assert table_of(engine, tmp_path / "far") == table_of("local", tmp_path / "near")
    assert len((tmp_path / "far" / "trials.csv").read_text().splitlines()) == 5


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # Ray's own
def test_a_trial_that_dies_on_a_cluster_is_a_row_with_its_cause_too(tmp_path):
    pytest.importorskip("ray")
    wanted = specs("good", "killed", "bad", f"once:{tmp_path / 'died'}")
    found = by_condition(engine_of("ray", Means(jobs=2)), wanted)
    assert {c for c, r in found.items() if r.fault.startswith(LOST)} == {"killed", "bad"}
    assert repr(found["good"]) == repr(toy_trial.run(wanted[0])) and len(found) == 4


@pytest.mark.slow
@pytest.mark.parametrize("address", ["auto", "127.0.0.1:9"])
def test_a_cluster_that_is_not_there_is_one_line(address, capfd):
    pytest.importorskip("ray")
    assert main(["experiment", "hri", "--engine", f"ray:{address}", "--trials", "1"]) == 1
    err = capfd.readouterr().err
    assert "no Ray cluster answers" in err and err.count("\n") == 1
