"""The report's tables: every figure of every condition, and differences seed by seed."""

from collections.abc import Sequence

import numpy as np

from app.config import Params
from app.control.registry import kind_of
from app.page import Html, html, table
from app.studies.conditions import SHORT
from app.studies.paired import Paired
from app.studies.report.trials import Trials
from app.studies.report.verdicts import interval
from app.studies.report.words import NOTHING, OVERS, Figure, figure_of, p_words

SURE = 0.05  # p


def metrics(trials: Trials) -> Html:
    """A row a figure, a column a condition."""
    rows = []
    for key in trials.figures():
        f = figure_of(key)
        how = "" if f.over == "mean" else f" <small>{OVERS[f.over]}</small>"
        label = Html(f'<span title="{html(f.means)}">{html(f.title)}</span>{how}')
        rows.append([label, *(interval(trials, name, key) for name in trials.of)])
    return Html(f"<h2>All figures</h2>{table(['', *trials.of], rows)}")


def gains(trials: Trials) -> Html:
    """Our controller against each other one on its side, over what the experiment is about."""
    ours = Params().mode
    label = next((n for n, mode in SHORT.items() if mode == ours), kind_of(ours).label)
    pairs = [p for p in trials.pairs() if trials.is_ours(p[0])]
    return _differences(trials, f"What does {label} gain?", pairs, trials.looked_at())


def others(trials: Trials) -> Html:
    """The other controllers among themselves."""
    pairs = [p for p in trials.pairs() if not trials.is_ours(p[0])]
    return _differences(trials, "The others, seed by seed", pairs, trials.looked_at())


def oracle_gap(trials: Trials) -> Html:
    """What perception costs: each condition less the one that perceives the truth."""
    return _differences(
        trials, "What perception costs: condition less oracle", trials.gaps(), trials.looked_at()
    )


def _differences(
    trials: Trials, title: str, pairs: Sequence[tuple[str, str]], keys: Sequence[str]
) -> Html:
    """A row a pair, a column a figure; coloured where it is hardly by chance."""
    found = {(a, b, k): trials.difference(a, b, k) for a, b in pairs for k in keys}
    keys = [k for k in keys if any(found[a, b, k].n for a, b in pairs)]
    if not keys:
        return Html("")
    rows = [[f"{a} - {b}", *(_cell(figure_of(k), found[a, b, k]) for k in keys)] for a, b in pairs]
    judged = [_side(figure_of(k), found[a, b, k]) for a, b in pairs for k in keys]
    seeds = max(d.n for d in found.values())
    count = {side: judged.count(side) for side in ("good", "bad")}
    words = (
        f"Of {len(judged)} differences {count['good']} are for the better and {count['bad']} for "
        f"the worse with p up to {SURE:g}, of {seeds} seeds."
    )
    if 2.0 ** (1 - seeds) > SURE:
        words += f" So few seeds cannot show anything: their least p is {2.0 ** (1 - seeds):.2g}."
    return Html(
        f"<h2>{html(title)}</h2><p>{html(words)}</p>"
        f"{table(['', *(figure_of(k).title for k in keys)], rows)}"
    )


def _cell(figure: Figure, d: Paired) -> Html:
    if not d.n:
        return Html(NOTHING)
    limits = f"[{figure.show(d.low, True)}, {figure.show(d.high, True)}] {p_words(d.p)}"
    small = f"<small>{html(limits)}</small>" if d.n > 1 else ""
    return Html(f'<span class="{_side(figure, d)}">{html(figure.show(d.mean, True))}</span>{small}')


def _side(figure: Figure, d: Paired) -> str:
    """'good', 'bad', or '' where it may be chance or is neither."""
    if not d.p <= SURE or not figure.better:
        return ""
    return "good" if np.sign(d.mean) == figure.better else "bad"
