"""The report of a study as one page: sections, one below another, and pictures within it."""

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from app.colours import ALARM, CALM, css
from app.page import Html, html, sheet
from app.report import Report
from app.studies.report.clips import BEGUN, Clip
from app.studies.report.head import head
from app.studies.report.pictures import Picture
from app.studies.report.tables import gains, metrics, oracle_gap, others
from app.studies.report.trials import Trials
from app.studies.report.verdicts import beside_paper, verdicts
from app.studies.report.words import FIGURES

STYLE = f"""
:root {{ --good: {css(CALM)}; --bad: {css(ALARM)}; }}
@media (prefers-color-scheme: dark) {{ :root {{ --good: #6fcf97; --bad: #ff8a73; }} }}
body {{ max-width: 84rem; }}
small {{ color: var(--soft); white-space: nowrap; }} td small {{ display: block; }}
td:first-child {{ white-space: nowrap; }}
.good {{ color: var(--good); }} .bad {{ color: var(--bad); }}
dl {{ display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1rem; }}
dt {{ color: var(--soft); }} dd {{ margin: 0; overflow-wrap: anywhere; }}
.checks {{ padding-left: 1.2rem; }}
.grid {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 34rem), 1fr));
  gap: 1rem; }}
img {{ width: 100%; height: auto; display: block; border-radius: .3rem; background: #fff; }}
td {{ vertical-align: top; }} th {{ vertical-align: bottom; font-weight: 600; }}
"""


class Shown(NamedTuple):
    """What a page shows beside its tables."""

    trials: Sequence[Picture] = ()
    courses: Sequence[Picture] = ()
    clips: Sequence[Clip] = ()


def page(trials: Trials, report: Report, folder: Path, shown: Shown) -> str:
    """The whole page of a study whose `folder` it lies in."""
    body = "".join((
        head(trials, folder),
        verdicts(trials, report),
        beside_paper(trials),
        gains(trials),
        _pictures("All trials", shown.trials),
        _pictures("Over time", shown.courses, "grid"),
        _clips(shown.clips, folder),
        metrics(trials),
        oracle_gap(trials),
        others(trials),
        _meanings(trials),
    ))  # fmt: skip
    return sheet(f"Flinch: experiment {trials.study.experiment}", Html(body), STYLE)


def _pictures(title: str, pictures: Sequence[Picture], kind: str = "") -> str:
    """Pictures below each other, with their words, or in a grid, where these are in them."""
    if not pictures:
        return ""
    inside = "".join(
        f'<figure><img src="{_data(p.path)}" alt="{html(p.words)}">'
        f"<figcaption>{'' if kind else html(p.words)}</figcaption></figure>"
        for p in pictures
    )
    return f'<h2>{html(title)}</h2><div class="{kind}">{inside}</div>'


def _clips(clips: Sequence[Clip], folder: Path) -> str:
    """A line a moment, with links to what lies beside the page."""
    if not clips:
        return ""
    lines = ""
    for clip in clips:
        links = [
            f'<a href="{quote(str(path.relative_to(folder)))}">{what}</a>'
            for path, what in ((clip.page, "look at it"), (clip.path, "recording"))
            if path.is_file()
        ]
        lines += f"<li>{html(clip.words)}: {', '.join(links)}</li>"
    words = (
        f"The least true distances of all trials after their first {BEGUN:g} s; each trial was run "
        "again and recorded up to there."
    )
    return f"<h2>The worst moments</h2><p>{words}</p><ol>{lines}</ol>"


def _data(path: Path) -> str:
    """A picture as what a page can hold."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


def _meanings(trials: Trials) -> Html:
    lines = "".join(
        f"<dt>{html(FIGURES[k].label)}</dt><dd>{html(FIGURES[k].means)}</dd>"
        for k in trials.figures() if k in FIGURES and FIGURES[k].means
    )  # fmt: skip
    words = (
        "Differences are means over seeds that both conditions have, with the interval of 95 % of "
        "means drawn again, and p of the signed-rank test of Wilcoxon, exact for few seeds and not "
        "corrected for the number of comparisons."
    )
    return Html(f"<h2>What the figures mean</h2><p>{words}</p><dl>{lines}</dl>")
