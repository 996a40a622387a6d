"""A study's folder: the same tables whatever was stopped, in which order and by how many shards."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app.cli import main
from app.cli.experiments.progress import Pace, shown
from app.errors import ConfigError
from app.studies.engines import LOST
from app.studies.engines.local import here
from app.studies.folder import Folder, table
from app.studies.matrix import opened, read_matrix, tell_matrix
from app.studies.study import Study, run_parts, tell
from app.studies.trial import TrialResult
from app.timing import ManualClock
from tests import toy_study  # makes its experiment known
from tests.toy_trial import run

STUDY = Study(toy_study.NAME)
TABLES = ("trials.csv", "table.csv")


def play(folder, shard="1/1", study=STUDY):
    """Run a shard of a study into a folder, and write what is told."""
    part = folder.part(study, shard)
    run_parts([part], here, shard)
    results = part.results()
    folder.begin(study)
    folder.write(study, results, tell(study, results))
    return results


def tables(folder):
    return [(folder.path / name).read_bytes() for name in TABLES]


def test_trials_stand_by_condition_and_seed_with_their_scalar_figures(tmp_path):
    folder = Folder(tmp_path / "new" / "study")
    play(folder)
    lines = (folder.path / "trials.csv").read_text().splitlines()
    assert lines[0] == "condition,seed,fault,x,n,never,words"
    assert lines[1] == f'good,0,,{1 / 3!r},0,nan,"a,b"'
    assert [x.split(",")[0] for x in lines[1:]] == ["good"] * 3 + ["fine"] * 3
    said = json.loads((folder.path / "study.json").read_text())
    assert said["conditions"] == ["good", "fine"] and said["versions"]["numpy"]
    assert said["settings"] == STUDY.settings
    assert "machine" in json.loads((folder.path / "table.json").read_text())
    assert "machine" not in (folder.path / "table.csv").read_text()


def test_shards_write_into_one_folder_and_any_of_them_tells_of_all_that_is_there(tmp_path):
    whole, shared = Folder(tmp_path / "whole"), Folder(tmp_path / "shared")
    play(whole)
    assert len(play(shared, "2/4")) == 2
    report = json.loads((shared.path / "table.json").read_text())
    missing = next(c for c in report["checks"] if c["name"].startswith("trials missing of the 6"))
    assert missing["value"] == 4.0 and not missing["ok"]
    for shard in ("4/4", "1/4", "3/4"):
        play(shared, shard)
    assert tables(shared) == tables(whole)
    assert len(list(shared.path.glob("trials-*of4.jsonl"))) == 4
    part = shared.part(STUDY)
    run_parts([part], None)  # nothing is run again, nobody could
    assert len(part.results()) == 6


def test_two_runs_of_one_shard_into_one_folder_are_refused(tmp_path):
    folder = Folder(tmp_path)
    with folder.writing("1/2"), folder.writing("2/2"):
        with (
            pytest.raises(ConfigError, match="another run writes it") as told,
            folder.writing("1/2"),
        ):
            pass
        assert "\n" not in str(told.value)
    with folder.writing("1/2"):
        pass


def test_a_trial_that_its_machine_failed_is_run_again_and_one_that_died_is_not(tmp_path):
    folder = Folder(tmp_path)
    part = folder.part(STUDY)
    part.log.add(TrialResult(0, "good", fault=LOST + "its process died (SIGKILL)"))
    part.log.add(TrialResult(1, "good", fault="the trial died: ValueError()"))
    ran = []
    run_parts(
        [folder.part(STUDY)], lambda trial, specs: (ran.append(s) or (s, run(s)) for s in specs)
    )
    assert len(ran) == 5 and (ran[0].seed, ran[0].condition) == (0, "good")
    faults = {(r.seed, r.condition): r.fault for r in folder.part(STUDY).results()}
    assert faults[0, "good"] == "" and faults[1, "good"]


@pytest.mark.parametrize("left", [12, 300])
def test_a_first_line_that_was_torn_by_a_kill_is_run_again(tmp_path, left):
    folder = Folder(tmp_path)
    whole = play(folder)
    log = tmp_path / "trials.jsonl"
    log.write_bytes(log.read_bytes()[:left])
    assert repr(play(folder)) == repr(whole)


def test_a_column_stands_for_all_rows_and_a_cell_without_a_value_is_empty():
    assert table([{"a": 1, "b": True}, {"a": 2.5, "c": {"d": [1]}}], ()) == (
        'a,b,c\n1,True,\n2.5,,"{""d"": [1]}"\n'
    )


def toy(*args):
    return [sys.executable, "-m", "tests.toy_study", *map(str, args)]


def wait_for_lines(path: Path, number: int, process) -> None:
    """Until so many trials are kept."""
    until = time.monotonic() + 100.0
    while not path.exists() or path.read_bytes().count(b"\n") < number:
        assert process.poll() is None and time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGINT])
def test_a_study_that_is_stopped_half_way_goes_on_to_the_same_tables(sent, tmp_path):
    study = ("--conditions", "good,slow:0.2", "--trials", 4)
    process = subprocess.Popen(
        toy("toy", *study, "--jobs", 2, "--out", tmp_path / "a"), stderr=subprocess.PIPE, text=True
    )
    wait_for_lines(tmp_path / "a" / "trials.jsonl", 3, process)
    process.send_signal(sent)
    _, err = process.communicate()
    if sent == signal.SIGINT:
        last = err.splitlines()[-1]
        assert process.returncode == 1 and "Traceback" not in err
        assert last.startswith("flinch: stopped") and f"is kept in {tmp_path / 'a'}" in last
    assert not (tmp_path / "a" / "trials.csv").exists() and not list(tmp_path.rglob("*.new"))
    wanted = Study(toy_study.NAME, ("good", "slow:0.2"), trials=4)
    kept = len(Folder(tmp_path / "a").part(wanted).results())
    assert 3 <= kept < 8
    subprocess.run(toy("toy", *study, "--out", tmp_path / "a"), check=True, capture_output=True)
    play(Folder(tmp_path / "b"), study=wanted)
    assert tables(Folder(tmp_path / "a")) == tables(Folder(tmp_path / "b"))


MATRIX = """
experiment = "toy"
layouts = ["some", "mine.toml"]
conditions = ["good", "fine"]
worlds = ["honest", "honest,mounting=0"]
trials = 2
"""


def play_matrix(file, out, shard="1/1"):
    cells = read_matrix(file)
    with opened(cells, out, shard) as parts:
        run_parts(parts, here, shard)
        return tell_matrix(cells, out, shard)


def test_a_matrix_has_a_row_a_layout_and_condition_and_a_folder_a_cell(tmp_path):
    file = tmp_path / "m.toml"
    file.write_text(MATRIX)
    rows = play_matrix(file, tmp_path / "a").rows
    assert len(rows) == 8 and rows[1]["name"] == "some_honest fine"
    assert rows[-1]["layout"] == "mine.toml" and rows[-1]["condition"] == "fine"
    assert rows[-1]["world"] == "honest,mounting=0" and rows[-1]["trials"] == 2
    cells = sorted(p.parent.name for p in (tmp_path / "a").glob("*/trials.jsonl"))
    assert cells == sorted(c.name for c in read_matrix(file)) and len(cells) == 4
    assert not all(c.ok for c in play_matrix(file, tmp_path / "b", "1/2").checks)
    assert all(c.ok for c in play_matrix(file, tmp_path / "b", "2/2").checks)
    assert tables(Folder(tmp_path / "a")) == tables(Folder(tmp_path / "b"))
    assert len((tmp_path / "a" / "trials.csv").read_text().splitlines()) == 17


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("experiment = 'toy'\nlayouts = []", "layouts"),
        ("experiment = 'tea'\nlayouts = ['a']", "no experiment 'tea'"),
        ("experiment = 'toy'\nlayouts = ['a', 'x/a.toml']", "a there twice"),
        ("experiment = 'toy'\nlayouts = ['a']\nseconds = 0", "seconds"),
        ("experiment = 'hri'\nlayouts = ['scales']", "forearm-rings"),
        ("experiment = 'hri'\nlayouts = ['forearm-rings']\nconditions = ['XL']", "XL"),
        ("experiment = 'hri'\nlayouts = ['forearm-rings']\nworlds = ['nowhere']", "nowhere"),
    ],
)
def test_a_matrix_that_cannot_be_run_is_one_line_before_any_trial(text, words, tmp_path, capsys):
    file, out = tmp_path / "m.toml", tmp_path / "a"
    file.write_text(text)
    assert main(["experiment", "matrix", str(file), "--out", str(out)]) == 1
    err = capsys.readouterr().err
    assert words in err and err.count("\n") == 1 and not out.exists()


def test_a_matrix_without_a_folder_is_refused(capsys):
    assert main(["experiment", "matrix", "m.toml"]) == 1
    assert "--out DIR" in capsys.readouterr().err


def test_the_shipped_matrix_can_be_read():
    cells = read_matrix(Path(__file__).parent.parent / "static_assets/studies/hri-layouts.toml")
    assert [c.name for c in cells] == ["forearm-rings", "sparse-4x4"]


def test_what_is_left_is_told_from_what_was_done_since_the_beginning():
    clock = ManualClock()
    pace = Pace(clock.now)
    clock.t += 10.0
    pace.update(5, 25)  # four were there before
    assert pace.left == pytest.approx(200.0)
    assert pace.words() == "5 of 25 trials, about 3 min left"
    clock.t += 10.0
    pace.update(24, 25)
    assert pace.left == pytest.approx(1.0)
    pace.update(25, 25)
    assert pace.words() == "25 of 25 trials"


@pytest.mark.parametrize("quiet", [False, True])
def test_without_a_terminal_there_is_a_line_now_and_then_and_none_beside_json(quiet, capsys):
    clock = ManualClock()
    with shown("hri", Pace(clock.now), quiet) as show:
        for done in range(1, 31):
            clock.t += 1.0
            show(None, done, 30)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == (0 if quiet else 3)
    assert quiet or lines[0] == "hri: 10 of 30 trials, about 20 s left"
