"""The report's beginning: what was run, by what, and how to run it again."""

import shlex
from pathlib import Path

from app.control.registry import kind_of
from app.page import Html, html
from app.report import machine, versions
from app.studies.conditions import Condition
from app.studies.report.trials import Trials


def head(trials: Trials, folder: Path) -> Html:
    """Facts of the study, one a line."""
    m = machine()
    lines = {
        "Conditions": Html("<br>".join(_condition(trials, name) for name in trials.of)),
        "Trials": html(_extent(trials)),
        "World": html(_world(trials)),
        "Machine": html(f"{m['processor']}, {m['cores']} cores, {m['system']}"),
        "Versions": html(
            ", ".join(f"{k} {v}" for k, v in {**versions(), "Python": m["python"]}.items())
        ),
        "Again by": Html(f"<code>{html(command(trials, folder))}</code>"),
    }
    facts = "".join(f"<dt>{name}</dt><dd>{words}</dd>" for name, words in lines.items())
    died = "".join(
        f'<p class="bad">{html(f"{r.condition}, seed {r.seed}: {r.fault}")}</p>'
        for r in trials.died
    )
    return Html(f'<p class="soft">{html(trials.kind.help)}</p>{died}<dl>{facts}</dl>')


def command(trials: Trials, folder: Path) -> str:
    """What makes the same study again."""
    s, settings = trials.study, trials.study.settings
    asked = s.conditions or trials.kind.conditions
    words = ["flinch", "experiment", s.experiment, "--conditions", ",".join(asked)]
    words += ["--trials", str(trials.kind.trials if s.trials is None else s.trials)]
    words += ["--seconds", f"{float(settings['seconds']):g}", "--seed", str(s.seed)]
    words += ["--rate", f"{s.rate:g}", "--world", s.world]
    words += [*(["--skin", s.skin] if s.skin else []), "--out", folder.name]
    return shlex.join(words)


def condition_words(c: Condition) -> str:
    """A condition for who does not know its name."""
    words = [kind_of(c.mode).label, c.side, "nobody there" if c.alone else ""]
    words += ["perceives the truth" if c.oracle else ""]
    words += ["one pair a link" if c.one_pair else ""]
    words += [f"{key} = {value}" for key, value in c.changes]
    words += [f"world {part}" for part in c.world]
    words += [f"{c.failing} sensors {c.fault}" if c.fault else "", c.skin, c.variant]
    return ", ".join(filter(None, words))


def _condition(trials: Trials, name: str) -> Html:
    c, count = trials.read(name), len(trials.of[name])
    words = f": {condition_words(c)}" if c is not None else ""
    return Html(f"<b>{html(name)}</b>{html(words)} <small>({count})</small>")


def _extent(trials: Trials) -> str:
    seeds = sorted({r.seed for rs in trials.of.values() for r in rs})
    if not seeds:
        return "none"
    s = trials.study.settings
    which = f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
    return (
        f"{sum(map(len, trials.of.values()))} of {float(s['seconds']):g} s each, {which}, "
        f"{float(s['rate']):g} ticks a second; the same seed gives every condition the same "
        "sensors and the same world"
    )


def _world(trials: Trials) -> str:
    s = trials.study
    return f"error budget {s.world}; sensor layout {s.skin or 'of the robot'}"
