"""The report of a study as one page: sections, one below another, and pictures within it."""

import base64
from collections.abc import Sequence
from pathlib import Path

from app.colours import ALARM, CALM, css
from app.page import Html, html, sheet
from app.report import Report
from app.studies.report.head import head
from app.studies.report.pictures import Picture, draw_courses, draw_trials
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


def page(trials: Trials, report: Report, folder: Path, clips: Html) -> str:
    """The whole page; its pictures are drawn into `folder` on the way."""
    body = "".join((
        head(trials, folder),
        verdicts(trials, report),
        beside_paper(trials),
        gains(trials),
        _shown("All trials", draw_trials(trials, folder), "", trials),
        _shown("Over time", draw_courses(trials, folder), "grid", trials),
        clips,
        metrics(trials),
        oracle_gap(trials),
        others(trials),
        _meanings(trials),
    ))  # fmt: skip
    return sheet(f"Flinch: experiment {trials.study.experiment}", Html(body), STYLE)


def _shown(title: str, pictures: Sequence[Picture], kind: str, trials: Trials) -> str:
    if not pictures:
        return ""
    shown = "".join(
        f'<figure><img src="{_data(p.path)}" alt="{html(p.words)}">'
        f"<figcaption>{'' if kind else html(p.words)}</figcaption></figure>"
        for p in pictures
    )
    return f'<h2>{html(title)}</h2><div class="{kind}">{shown}</div>'


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
