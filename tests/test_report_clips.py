"""A study's worst moments: found among its trials, run again, recorded, shown and linked."""

import numpy as np
import pytest

from app.cli.experiments.told import export_clip
from app.record.reader import open_recording
from app.report import Report
from app.studies.report import write_report
from app.studies.report.clips import AFTER, BEFORE, Clip, record_worst, worst
from app.studies.report.trials import Trials
from app.studies.study import Study, locally, run_study
from app.studies.trial import TrialResult

STAMP = [8.0 + 0.1 * i for i in range(100)]  # the clock of a trial may begin anywhere


def trial(name, seed, least, at, first=1.0, **figures):
    """Nearest `at` [s] after its beginning, where it was `first` [m] away."""
    true = [1.0] * len(STAMP)
    true[0], true[round(10 * at)] = first, least
    return TrialResult(seed, name, figures, {"stamp_s": STAMP, "true_m": true})


def test_the_nearest_moments_are_found_but_where_it_began_and_those_of_the_oracle():
    far = TrialResult(2, "SL", {}, {"stamp_s": STAMP, "true_m": [np.inf] * len(STAMP)})
    results = [
        trial("SL", 0, 0.08, 4.0), trial("SL", 1, 0.05, 6.5, first=0.01), far,
        trial("WBL", 0, 0.0, 3.0, contacts=1), trial("WBL", 1, 0.0, 2.0, contacts=4),
        trial("oracleL", 0, 0.0, 3.0, contacts=9), TrialResult(3, "SL", fault="gone"),
        TrialResult(4, "SL"),
    ]  # fmt: skip
    found = worst(Trials(Study("hri", ("SL", "WBL", "oracleL")), results), 3)
    assert [(m.result.condition, m.result.seed) for m in found] == [
        ("WBL", 1), ("WBL", 0), ("SL", 1),
    ]  # fmt: skip
    assert found[2].distance == 0.05 and found[2].at == pytest.approx(6.5)
    assert len(worst(Trials(Study("hri", ("SL", "WBL")), results), 9)) == 4


def test_the_page_links_what_lies_beside_it_and_nothing_else(tmp_path, monkeypatch):
    kept = tmp_path / "clips"
    kept.mkdir()

    def recorded(trials, folder, count):
        assert folder == kept and count == 2
        for name in ("1-SL+dead_3-0", "2-SL-1"):
            (folder / f"{name}.mcap").write_bytes(b"recording")
            yield Clip(folder / f"{name}.mcap", 1.0, 7.0, "SL <nearest>")

    def export(recording, page, begin, end):
        assert recording.is_file() and (begin, end) == (1.0, 7.0)
        if recording.stem.startswith("1"):
            page.write_text("a page")

    monkeypatch.setattr("app.studies.report.record_worst", recorded)
    (kept / "2-SL-1.html").write_text("of another study")
    results, told = [TrialResult(0, "SL", {"paper_mean_m": 0.2})], []
    write_report(
        Study("hri", ("SL",)), results, Report("hri", 0, []), tmp_path, 2, told.append, export
    )
    text = (tmp_path / "report.html").read_text("utf-8")
    links = [part.partition('"')[0] for part in text.split('href="')[1:]]
    assert links == [
        "clips/1-SL%2Bdead_3-0.html",
        "clips/1-SL%2Bdead_3-0.mcap",
        "clips/2-SL-1.mcap",
    ]
    assert "SL &lt;nearest&gt;" in text and len(told) == 3


@pytest.mark.slow
def test_a_moment_is_run_again_recorded_and_shown(tmp_path):
    study = Study("hri", ("WBR",), trials=1, seconds=3.0, seed=3)
    trials = Trials(study, run_study(study, locally()))
    (clip,) = record_worst(trials, tmp_path / "clips", 3)
    (moment,) = worst(trials, 1)
    assert clip.words == f"WBR, seed 3: {moment.distance:.3f} m at {moment.at:.1f} s"
    assert clip.begin == max(moment.at - BEFORE, 0.0) and clip.end == min(moment.at + AFTER, 3.0)
    with open_recording(clip.path) as recording:
        assert recording.times[-1] - recording.times[0] == pytest.approx(clip.end, abs=0.02)
    export_clip(clip.path, clip.page, clip.begin, clip.end)
    assert "<html" in clip.page.read_text("utf-8")[:200]
    trials.of["WBR"][0].course["true_m"][4] += 0.001
    (other,) = record_worst(trials, tmp_path / "clips", 3)
    assert "not the same run" in other.words
