"""The report of a study: one page that needs nothing but itself, and its pictures beside it.

results ─► Trials ─► sections and pictures ─► report.html, trials.png, course-*.png
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from app.page import Html, write_sheet
from app.plot import check_matplotlib
from app.report import Report
from app.studies.report.page import page
from app.studies.report.trials import Trials
from app.studies.study import Study
from app.studies.trial import TrialResult

NAME = "report.html"


def check_report() -> None:
    """ConfigError, before hours of trials, where their report could not be drawn."""
    check_matplotlib("the report of --out")


def write_report(
    study: Study, results: Sequence[TrialResult], report: Report, folder: Path,
    clips: int = 3, say: Callable[[str], None] = print,
) -> None:  # fmt: skip
    """Write `report.html` and its pictures into `folder`.

    say: is told of what is there.
    Raises ConfigError for a place that cannot be written.
    """
    path = folder / NAME
    write_sheet(path, page(Trials(study, results), report, folder, Html("")))
    say(f"{path}: opens in any browser")
