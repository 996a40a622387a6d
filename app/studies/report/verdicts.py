"""What the study says at a glance: its checks in words, and its figures beside others'."""

from app.page import Html, html, table
from app.report import Check, Report
from app.studies.report.trials import Trials
from app.studies.report.words import NOTHING, figure_of, in_words

OF_TRIALS = "trials "  # begins the checks of the study itself, of those that died or are missing


def verdicts(trials: Trials, report: Report) -> Html:
    """Each check with its value, its interval where there is one, and its verdict."""
    checks = [c for c in report.checks if not c.name.startswith(OF_TRIALS)]
    lacking = [c for c in report.checks if c.name.startswith(OF_TRIALS) and not c.ok]
    lacks = "".join(f'<p class="bad">{html(f"{c.name}: {c.value:g}")}</p>' for c in lacking)
    if not checks:
        return Html(lacks)
    title = "Does Flinch reproduce the paper?" if trials.kind.paper else "Checks"
    good, bad = trials.kind.verdicts
    count = sum(c.ok for c in checks)
    rows = {r["name"]: r for r in report.rows if {"low", "high"} <= r.keys()}
    lines = "".join(
        f'<li class="{"good" if c.ok else "bad"}">{html(verdict(c, rows.get(c.name)))}: '
        f"<b>{html(good if c.ok else bad)}</b></li>"
        for c in checks
    )
    return Html(
        f"<h2>{title}</h2>{lacks}<p><b>{count} of {len(checks)}</b> {html(good)}.</p>"
        f'<ul class="checks">{lines}</ul>'
    )


def verdict(c: Check, row: dict[str, float] | None = None) -> str:
    """A check in words, without the verdict; row: has the limits of its interval."""
    unit = f" {c.unit}" if c.unit else ""
    if row is None:
        value = f"{c.value:.3g}{unit}"
    else:
        value = f"{c.value:+.3f}{unit} [{row['low']:.3f}, {row['high']:.3f}]"
    side = "at least" if c.at_least else "at most"
    return f"{in_words(c.name)}: {value}, demanded {side} {c.limit:g}{unit}"


def beside_paper(trials: Trials) -> Html:
    """The published figures beside ours, with the interval of ours."""
    paper = trials.kind.paper
    if not any(name in paper for name in trials.of):
        return Html("")
    keys = list(dict.fromkeys(k for figures in paper.values() for k in figures))
    top = ["condition", "trials"]
    for key in keys:
        top += [figure_of(key).title, "paper's", "ours - paper's"]
    rows = []
    for name in trials.of:
        row: list[object] = [name, len(trials.of[name])]
        for key in keys:
            row += _beside(trials, name, key)
        rows.append(row)
    note = "Intervals are of 95 % of the means drawn again (bootstrap)"
    if any(figure_of(k).over == "mean" for k in keys):
        note += "; green: the paper's value lies in it"
    return Html(f'<h2>Beside the paper\'s table</h2>{table(top, rows)}<p class="soft">{note}.</p>')


def _beside(trials: Trials, name: str, key: str) -> list[object]:
    figure, ours = figure_of(key), trials.over(name, key)
    theirs = trials.kind.paper.get(name, {}).get(key)
    if theirs is None:
        return [interval(trials, name, key), NOTHING, NOTHING]
    inside = ours.low <= theirs <= ours.high
    gap = html(figure.show(ours.mean - theirs, signed=True))
    shown = Html(f'<span class="good">{gap}</span>') if inside else gap
    return [interval(trials, name, key), figure.show(theirs), shown]


def interval(trials: Trials, name: str, key: str) -> Html:
    """A figure over the trials of a condition, with its limits in small."""
    figure = figure_of(key)
    mean, low, high = map(figure.show, trials.over(name, key))
    same = low == high in (NOTHING, mean)  # one trial, or all alike
    small = "" if same else f" <small>{html(f'[{low}, {high}]')}</small>"
    return Html(f"{html(mean)}{small}")
