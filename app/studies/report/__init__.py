"""The report of a study: one page that needs nothing but itself, and its pictures beside it.

results ─► Trials ─► sections and pictures ─► report.html, trials.png, course-*.png, together-*.png
                 └─► worst moments ─► clips/*.mcap, and by the command line clips/*.html
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from app.page import write_sheet
from app.plot import check_matplotlib
from app.report import Report
from app.studies.report.clips import record_worst
from app.studies.report.page import Shown, page
from app.studies.report.pictures import draw_courses, draw_trials
from app.studies.report.trials import Trials
from app.studies.study import Study
from app.studies.trial import TrialResult

NAME = "report.html"
# Makes the second file, a page, of a recording, from [s] to [s] since its beginning.
Export = Callable[[Path, Path, float, float], None]


def check_report() -> None:
    """ConfigError, before hours of trials, where their report could not be drawn."""
    check_matplotlib("the report of --out")


def write_report(
    study: Study, results: Sequence[TrialResult], report: Report, folder: Path,
    clips: int = 3, say: Callable[[str], None] = print, export: Export | None = None,
) -> None:  # fmt: skip
    """Write `report.html` and its pictures into `folder`, then record its worst moments there.

    clips:  so many moments.   say: is told what is there.
    export: makes a page of a recording's part, which the report then links.
    Raises ConfigError for a place that cannot be written.
    """
    trials, path = Trials(study, results), folder / NAME
    shown = Shown(draw_trials(trials, folder), draw_courses(trials, folder))
    write_sheet(path, page(trials, report, folder, shown))
    say(f"{path}: opens in any browser")
    for clip in record_worst(trials, folder / "clips", clips):
        say(f"{clip.path}: {clip.words}")
        clip.page.unlink(missing_ok=True)
        if export is not None:
            export(clip.path, clip.page, clip.begin, clip.end)
        shown = shown._replace(clips=(*shown.clips, clip))
        write_sheet(path, page(trials, report, folder, shown))
