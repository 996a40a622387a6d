"""A study's report as the command line writes it: its worst moments become pages, too."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # an answer to --help needs none of it
    from app.report import Report
    from app.studies.study import Study
    from app.studies.trial import TrialResult


def write_told(
    study: "Study", results: "Sequence[TrialResult]", report: "Report", folder: Path, clips: int = 3
) -> None:
    """The report in `folder`, and what it links."""
    from app.studies.report import write_report

    write_report(study, results, report, folder, clips, _say, export_clip)


def export_clip(recording: Path, page: Path, begin: float, end: float) -> None:
    """A part of a recording, [s] since its beginning, as a page."""
    from app.page import write_sheet
    from app.ui.export.export import Part
    from app.ui.export.recorded import page_from

    write_sheet(page, page_from([recording], Part(begin, end)))


def _say(words: str) -> None:
    print(words, file=sys.stderr, flush=True)  # what is printed may be asked for as JSON
