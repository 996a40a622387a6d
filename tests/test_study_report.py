"""The report of a study: its page holds the study's figures, and asks nobody for anything."""

import base64
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from app.errors import ConfigError
from app.studies.report import check_report, write_report
from app.studies.report.tables import gains
from app.studies.report.trials import Trials
from app.studies.report.words import FIGURES, NOTHING, figure_of, in_words
from app.studies.study import Study, tell
from app.studies.trial import TrialResult

DRAWN = ("SL", "oracleL")
CONDITIONS = ("SR", "SL", "WBR", "WBL", "QPL", "oracleL")
FIGURES_OF_ALL = {
    "paper_std_m": 0.1, "true_std_m": 0.1, "true_least_m": 0.05, "cell_least_m": 0.08,
    "contacts": 1, "stops": 0, "waypoints_per_min": 6.0, "reaction_s": float("nan"),
    "below_kept": 0.25, "path_error_m": 0.05, "nearest_link": {"forearm": 1.0},
}  # fmt: skip
COURSE = {
    "stamp_s": [0.1 * i for i in range(40)],
    "paper_m": [float("inf")] * 5 + [0.4] * 35,
    "true_m": [0.5 - 0.01 * i for i in range(40)],
    "activation": [0.0] * 20 + [0.7] * 20,
}


def trial(name, seed, mean, **more):
    figures = FIGURES_OF_ALL | {"paper_mean_m": mean, "true_mean_m": mean + 0.01} | more
    course = COURSE if name in DRAWN else {}  # pictures take their time
    return TrialResult(seed, name, figures, course, [[1.0, "walks <to> the door"]])


@pytest.fixture(scope="module")
def results():
    """Ten seeds that differ more than the conditions do."""
    means = {"SR": 0.28, "SL": 0.17, "WBR": 0.29, "WBL": 0.24, "QPL": 0.3, "oracleL": 0.32}
    return [
        trial("WB alone", 0, float("nan"), waypoints_per_min=12.0),
        *(
            trial(name, seed, mean + 0.1 * seed + 0.001 * (seed * i % 7))
            for seed in range(10) for i, (name, mean) in enumerate(means.items())
        ),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def written(results, tmp_path_factory):
    """The folder of a report, and the study with it."""
    folder = tmp_path_factory.mktemp("re port")
    study, told = Study("hri", CONDITIONS, trials=10), []
    write_report(study, results, tell(study, results), folder, clips=0, say=told.append)
    assert told == [f"{folder / 'report.html'}: opens in any browser"]
    return folder, study


class Asks(HTMLParser):
    """What a page would fetch, and its text."""

    def __init__(self):
        super().__init__()
        self.fetched, self.links, self.words = [], [], []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.links += [given["href"]] if tag == "a" else []
        self.fetched += [given[k] for k in ("src", "srcset", "data") if k in given]
        assert tag not in ("script", "link", "iframe", "object")

    def handle_data(self, data):
        self.words.append(data)


def read(folder):
    page = Asks()
    text = (folder / "report.html").read_text("utf-8")
    page.feed(text)
    return text, page, " ".join(" ".join(page.words).split())


def test_the_page_asks_nobody_for_anything(written):
    text, page, _ = read(written[0])
    assert "default-src 'none'" in text and "url(" not in text and "@import" not in text
    assert page.links == [] and len(page.fetched) == 4
    assert all(source.startswith("data:image/png;base64,") for source in page.fetched)


def test_the_pictures_lie_beside_the_page_and_within_it(written):
    folder, _ = written
    _, page, _ = read(folder)
    names = ["trials.png", "together-1.png", *(f"course-{i + 1}.png" for i in range(2))]
    for source, name in zip(page.fetched, names, strict=True):
        inside = base64.b64decode(source.partition(",")[2])
        assert inside == (folder / name).read_bytes() and inside[:4] == b"\x89PNG"


def test_the_figures_on_the_page_are_those_of_the_report(written, results):
    folder, study = written
    text, _, words = read(folder)
    rows = {r["name"]: r for r in tell(study, results).rows}
    for name in CONDITIONS[:5]:
        limits = f"[{rows[name]['low_m']:.3f}, {rows[name]['high_m']:.3f}]"
        assert f"<td>{rows[name]['dbar_m']:.3f} <small>{limits}</small></td>" in text
    gain = rows["WBL - SL, paper_mean_m"]
    verdict = (
        f"WBL - SL, distance between clouds, mean: {gain['mean']:+.3f} m "
        f"[{gain['low']:.3f}, {gain['high']:.3f}], demanded at least 0.05 m: reproduced"
    )
    assert verdict in words and "6 of 6 reproduced" in words and "trials that died" not in words
    assert "work against undisturbed" in words and "<td>50.0</td>" in text
    assert "flinch experiment hri --conditions SR,SL,WBR,WBL,QPL,oracleL --trials 10" in words
    assert "--seconds 60 --seed 0 --rate 125 --world honest" in words
    assert "seeds 0 to 9" in words and "--out 're port0'" in words


def test_differences_are_taken_seed_by_seed_with_ours_first(results):
    trials = Trials(Study("hri", CONDITIONS), results)
    assert trials.pairs() == [("QPL", "SL"), ("QPL", "WBL"), ("WBR", "SR"), ("WBL", "SL")]
    assert trials.gaps() == [("SL", "oracleL"), ("WBL", "oracleL"), ("QPL", "oracleL")]
    gain = trials.difference("QPL", "WBL", "paper_mean_m")
    assert gain.mean == pytest.approx(0.06, abs=0.004) and gain.p < 0.01 and gain.n == 10
    assert trials.values("WBL", "work") == dict.fromkeys(range(10), 0.5)
    assert trials.values("SL", "work") == {}  # nobody ran it alone
    assert trials.over("SL", "contacts").mean == 10.0
    assert np.isnan(trials.over("SL", "reaction_s").mean)


def test_what_is_hardly_chance_is_coloured_and_few_seeds_show_nothing(written, results):
    text, _, _ = read(written[0])
    assert re.search(r'<span class="good">\+0\.13\d</span>', text)  # QPL - SL
    few = gains(Trials(Study("hri", CONDITIONS), [r for r in results if r.seed < 2]))
    assert '"good"' not in few and "What does QP gain?" in few
    assert "So few seeds cannot show anything: their least p is 0.5" in few


def test_names_and_faults_cannot_break_the_page(tmp_path):
    mean = trial("SR<b>", 0, 0.2, **{"<i>odd_m": 0.5})
    dead = TrialResult(1, "SL", fault="it died: <script>alert('x')</script>")
    kind = Study("worlds-of-others")
    with pytest.raises(ConfigError):
        Trials(kind, [])
    study = Study("hri", ("SR",), trials=1)
    good = TrialResult(0, "SR", mean.figures, COURSE, [[1.0, "<b>"]])
    write_report(study, [good, dead], tell(study, [good, dead]), tmp_path, 0, lambda words: None)
    text, _, words = read(tmp_path)
    assert "<script" not in text and "SL, seed 1: it died: <script>alert('x')</script>" in words
    assert "<i>odd" not in text and "<i>odd [m]" in words


def test_a_study_of_which_every_trial_died_still_has_a_page(tmp_path):
    dead = [TrialResult(0, "SR", fault="gone")]
    study = Study("hri", ("SR",), trials=1)
    write_report(study, dead, tell(study, dead), tmp_path, 0, lambda words: None)
    words = read(tmp_path)[2]
    assert "SR, seed 0: gone" in words and "trials that died: 1" in words
    assert not list(tmp_path.glob("*.png"))


def test_a_figure_that_nobody_described_says_what_its_name_says():
    assert figure_of("goal_error_m").title == "goal error [m]"
    assert figure_of("seen_share").show(0.5) == "50.0" and figure_of("apples").show(3.0) == "3"
    assert FIGURES["contacts"].show(12.0) == "12" and FIGURES["work"].show(float("nan")) == NOTHING
    assert in_words("WBL - SL, true_mean_m, low") == "WBL - SL, true distance, mean, lower limit"


def test_without_what_draws_it_a_report_is_refused_before_the_study(monkeypatch):
    monkeypatch.setattr("app.plot.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"install flinch\[plot\]"):
        check_report()
