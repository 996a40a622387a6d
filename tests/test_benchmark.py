"""The benchmark: its list, its trials, which are run once, and its table."""

import csv
import io
import json

import pytest

from app.cli import main
from app.control.guests.files import is_guest
from app.control.registry import forget, kinds
from app.errors import ConfigError
from app.studies.benchmark.attempt import attempted
from app.studies.benchmark.listing import only_sets, read_list
from app.studies.benchmark.run import run_benchmark
from app.studies.benchmark.table import ALL, rows_of
from app.studies.benchmark.write import as_csv, as_page, markdown
from app.studies.trial import TrialResult, TrialSpec
from tests.test_guests import acting

LIST = """
version = 7
world = "honest"
distance_kept_m = 0.3
seeds = 2
quick_seeds = 1
rate_hz = 125.0

[[set]]
name = "plate"
scene = "front-panel"
seconds = 0.3
quick_s = 0.2

[[set]]
name = "person"
experiment = "hri"
sides = ["L", "R"]
seconds = 0.3
work = true
"""


@pytest.fixture
def listed(tmp_path):
    path = tmp_path / "list.toml"
    path.write_text(LIST)
    return path


@pytest.fixture(autouse=True)
def no_guest_stays():
    yield
    for name in [n for n in kinds() if is_guest(n)]:
        forget(name)


def figures(seed, short=0.01, **more):
    out = {
        "contacts": 1, "own_contacts": 0, "stops": 0, "true_least_m": 0.1 + 0.01 * seed,
        "shortfall_m": short + 0.001 * seed, "waypoints_per_min": 3.0, "path_error_m": 0.1,
        "own_reaction_s": float("nan"), "jumps_per_s": 1.0, "jerk_rms": 100.0, "effort": 2.0,
        "held_back": 0.25,
    }  # fmt: skip
    return out | more


def pretended(trial, specs):
    """Results without any run, in another order; guests are worse than the oracle by 2 mm."""
    assert trial is attempted
    for spec in reversed(specs):
        alone, oracle = spec.condition.endswith(" alone"), spec.condition.startswith("oracle")
        more = {"waypoints_per_min": 4.0 if alone else 3.0}
        course = {"true_m": [0.2, 0.295, 0.4, 0.4]}
        found = figures(spec.seed, 0.010 if oracle else 0.012, **more)
        yield spec, TrialResult(spec.seed, spec.condition, found, course)


def test_the_shipped_list_asks_what_every_controller_can_be_asked():
    whole, quick = read_list(), read_list(quick=True)
    whole.check(["qp", "wb", "sm", "paper", "oracle", "potential_field.py"])
    assert whole.digest == quick.digest and len(quick.sets) < len(whole.sets)
    assert len(whole.digest) == 8 and whole.digest in whole.title and "quick" in quick.title
    seconds = sum(quick.seconds(s) * quick.seeds * len(s.sides) for s in quick.sets)
    assert 20.0 < seconds < 40.0  # about a minute a controller
    spec = next(iter(whole.specs(whole.sets[0], "qp").values()))
    assert spec == TrialSpec("scene:front-panel", "QP+set:distance_kept=0.25", 0, 8.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('scene = "front-panel"', "", "give either a scene or an experiment"),
        ('name = "person"', 'name = "plate"', "two sets are called 'plate'"),
        ('scene = "front-panel"', 'scene = "front"', "'front' is neither a path nor a name"),
        ("seeds = 2", "seeds = 0", "seeds"),
        ("version = 7", "version = 7\nseries = 1", "series"),
    ],
)
def test_a_list_that_cannot_be_run_is_told_in_one_line(listed, old, new, words):
    listed.write_text(LIST.replace(old, new, 1))
    with pytest.raises(Exception, match=words) as refused:
        read_list(listed)
    assert "\n" not in str(refused.value)


def test_another_list_has_another_digest_and_unknown_names_are_refused(listed):
    before = read_list(listed)
    listed.write_text(LIST.replace("seconds = 0.3", "seconds = 0.4", 1))
    assert read_list(listed).digest != before.digest
    assert [s.name for s in only_sets(before, ["person"]).sets] == ["person"]
    with pytest.raises(ConfigError, match="no set 'persn'; did you mean 'person'"):
        only_sets(before, ["persn"])
    with pytest.raises(ConfigError, match="no condition 'nobody"):
        before.check(["nobody"])


def test_rows_pair_every_trial_with_the_oracle_s_and_its_work_with_that_done_alone(listed):
    outcomes = run_benchmark(read_list(listed), ["potential_field.py", "oracle"], pretended)
    rows = {(r["set"], r["controller"]): r for r in rows_of(outcomes, 0.3)}
    mine = rows["person", "potential_field.py"]
    assert mine["trials"] == 4 and mine["contacts"] == 4 and mine["least_m"] == 0.1
    gap = [mine[key] for key in ("gap_mm", "gap_mm_low", "gap_mm_high")]
    assert gap == pytest.approx([2.0, 2.0, 2.0])
    assert mine["short_mm"] == pytest.approx(12.5) and mine["short_mm_low"] < 12.5
    assert mine["work"] == 0.75 and "work" not in rows["plate", "potential_field.py"]
    assert mine["below"] == 0.25 and "reaction_s" not in mine
    assert mine["cut"] == 0.25 and "cut" not in rows["person", "oracle"]
    assert "gap_mm" not in rows["person", "oracle"]
    assert rows[ALL, "potential_field.py"]["contacts"] == 6
    assert list(rows)[:2] == [(ALL, "potential_field.py"), (ALL, "oracle")]


def test_known_trials_are_not_run_again_but_those_of_a_file_that_has_changed(listed, tmp_path):
    ran = []

    def counted(trial, specs):
        ran.append(len(specs))
        yield from pretended(trial, specs)

    path, folder = tmp_path / "mine.py", tmp_path / "trials"
    path.write_text(acting("return np.zeros(6)"))
    controllers, bench = [str(path), "qp"], read_list(listed)
    first = run_benchmark(bench, controllers, counted, folder)
    again = run_benchmark(bench, controllers, counted, folder)
    assert ran == [2 * (2 + 4 + 1)] and repr(rows_of(again, 0.3)) == repr(rows_of(first, 0.3))
    path.write_text(acting("return np.ones(6)"))
    run_benchmark(bench, controllers, counted, folder)
    assert ran[1:] == [2 + 4 + 1]


def test_a_guest_that_fails_is_a_row_with_its_cause_and_the_others_go_on(listed, tmp_path, capsys):
    path, out = tmp_path / "mine.py", tmp_path / "out"
    path.write_text(acting("raise RuntimeError('no idea')"))
    command = ["benchmark", "--quick", f"--list={listed}", f"--out={out}", "--no-clips"]
    command += [f"--controller={path}", "--controllers=wb"]
    assert main(command) == 0
    told = capsys.readouterr().out
    assert "| mine.py | 0 |" in told and "| wb | 1 | 0 |" in told
    assert "mine.py: act raised RuntimeError('no idea'), line 7 of mine.py, at 0.0" in told
    assert (out / "benchmark.md").read_text() in told
    data = json.loads((out / "benchmark.json").read_text())
    assert data["faults"][0]["controller"] == "mine.py" and "list " in data["what"]
    row = next(csv.DictReader(io.StringIO((out / "benchmark.csv").read_text())))
    assert row["set"] == ALL and row["controller"] == "mine.py" and row["died"] == "1"
    page = (out / "index.html").read_text()
    assert "no idea" in page and "gallery" not in page and "<script" not in page


def test_what_a_guest_says_is_text_on_the_page():
    rows = [{"set": "<b>", "controller": "<i>.py", "trials": 1, "died": 1}]
    faults = [{"controller": "<i>.py", "set": "<b>", "seed": 0, "why": "<script>"}]
    page = as_page("t", rows, faults, "gallery/index.html")
    assert "<script" not in page and "<i>" not in page and 'href="gallery/index.html"' in page
    assert "<script>" in markdown("t", rows, faults) and "<b>,<i>.py,1" in as_csv(rows)


@pytest.mark.parametrize("wrong", ["--jobs=0", "--seeds=0", "--controllers=", "--controller=x.py"])
def test_what_makes_no_benchmark_is_refused_before_it(wrong, capsys):
    assert main(["benchmark", "--quick", wrong]) == 1
    err = capsys.readouterr().err
    assert err.startswith("flinch: ") and err.count("\n") == 1


@pytest.mark.slow
def test_the_gallery_shows_every_set_with_the_controllers_side_by_side(listed, tmp_path):
    out = tmp_path / "out"
    command = ["benchmark", "--quick", f"--list={listed}", f"--out={out}"]
    command += ["--controller=potential_field.py", "--controllers=wb,oracle"]
    assert main(command) == 0
    page = (out / "gallery" / "plate.html").read_text()
    assert "potential_field.py" in page and "Whole body, closest (WB)" in page
    assert "plate.html" in (out / "gallery" / "index.html").read_text()
    assert "gallery/index.html" in (out / "index.html").read_text()
