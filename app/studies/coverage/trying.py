"""Layouts that were placed: written, looked at as they are worn, and tried in random worlds."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.coverage.sites import LENS
from app.errors import ConfigError
from app.judge.blame import Cause
from app.messages import Array
from app.page import write_sheet
from app.report import Check, Report
from app.robot.draft_text import Ring, layout_text
from app.robot.skin_file import RingTable
from app.setup import Setup
from app.studies.coverage.placement import Placed, Wanted, place, problem_of, worn
from app.studies.engines import Means, engine_of
from app.studies.study import Study, run_study
from app.studies.trial import TrialResult
from app.studies.warm_up import warmed

WORLDS, CONDITION = "worlds", "QP"
OWN_ROBOT = "ur10e"  # whose random worlds there are
OWN = "the robot's own"
GREEDY = 1.0 - 1.0 / np.e  # what a greedy choice is worth at least, of the best, by theory
SEEN = "seen"
KNEE = 0.95  # of what the most sensors are worth


class Layout(NamedTuple):
    """A layout and its figures; `placed` is None for the robot's own, whose skin is "".

    seen:   its worth at postures that had no part in the choice, as it is worn, 0 to 1.
    worlds: figures of random worlds by name, empty where none were run.
    """

    name: str
    skin: str
    sensors: int
    placed: Placed | None
    seen: float
    worlds: dict[str, Any]


class Trying(NamedTuple):
    """What layouts are tried in: random worlds (0: none) from a seed on, where they are run."""

    worlds: int
    seed: int
    engine: str
    jobs: int

    def check(self, own: Setup) -> None:
        """ConfigError where there are no random worlds for this robot."""
        if self.worlds and (own.robot != OWN_ROBOT or own.urdf):
            raise ConfigError(
                f"--worlds are random worlds of the {OWN_ROBOT}; leave it out for another robot"
            )


def placed_layouts(
    wanted: Wanted, sensors: Sequence[int], q: Array, folder: Path, jobs: int,
    told: Callable[[], None],
) -> list[tuple[Placed, Path]]:  # fmt: skip
    """Place each number of sensors at postures q (m, n), and write `placed-N.toml`."""
    problem, out = problem_of(wanted, q, jobs, told), []
    for count in sensors:
        placed = place(wanted, problem, count)
        path = folder / f"placed-{count}.toml"
        write_sheet(path, text_of(placed.rings))
        out.append((placed, path))
    return out


def text_of(rings: Sequence[RingTable]) -> str:
    """The layout's file."""
    drawn = [
        Ring(
            f"ring{i + 1}", r.link, np.array(r.centre_m), np.array(r.axis), np.array(r.start),
            r.radius_m, r.count, r.tilt_deg,
        )
        for i, r in enumerate(rings)
    ]  # fmt: skip
    count = sum(r.count for r in rings)
    return layout_text(drawn, LENS, f"{count} sensors, placed")


def looked_at(
    wanted: Wanted, own: Setup, placed: Sequence[tuple[Placed, Path]], q: Array, trying: Trying
) -> list[Layout]:
    """The robot's own layout, if it has one, and those placed, at postures q (m, n) and in random
    worlds, the same for each."""
    out: list[Layout] = []
    if own.skin or not own.urdf:
        seen, sensors = worn(own, q, wanted)
        out.append(Layout(OWN, own.skin, sensors, None, seen, _worlds(own.skin, trying)))
    for p, path in placed:
        skin = str(path)
        seen, sensors = worn(replace(own, skin=skin), q, wanted)
        out.append(Layout(path.stem, skin, sensors, p, seen, _worlds(skin, trying)))
    return out


def _worlds(skin: str, trying: Trying) -> dict[str, Any]:
    if not trying.worlds:
        return {}
    run = engine_of(trying.engine, Means(trying.jobs, None, None))
    study = Study(WORLDS, (CONDITION,), trying.worlds, None, trying.seed, skin=skin)
    return world_figures(run_study(study, warmed(run) if trying.jobs > 1 else run))


def world_figures(results: Sequence[TrialResult]) -> dict[str, Any]:
    """Touches, those that nobody saw coming, and the median of the least distances."""
    good = [r.figures for r in results if not r.fault]
    touches = [f["touch"] for f in good if f["touch"]]
    least = [f["least"] for f in good if np.isfinite(f["least"])]
    return {
        "worlds": len(good),
        "touches": len(touches),
        "unseen": sum(t["cause"] == Cause.NOT_SEEN for t in touches),
        "median_least_m": float(np.median(least)) if least else float("nan"),
    }


def knee(layouts: Sequence[Layout]) -> Layout:
    """The placed layout with the fewest sensors that is worth nearly as much as any of them."""
    placed = [x for x in layouts if x.placed is not None]
    enough = KNEE * max(x.seen for x in placed)
    return min((x for x in placed if x.seen >= enough), key=lambda x: x.sensors)


def report_of(wanted: Wanted, layouts: Sequence[Layout], seed: int) -> Report:
    """A row each layout, and one each of its rings."""
    rows: list[dict[str, Any]] = []
    for x in layouts:
        row = {"name": x.name, "sensors": x.sensors, "worth_other_postures": x.seen}
        if x.placed is not None:
            row["worth_chosen_on"] = x.placed.choice.value / x.placed.whole
            row["of_the_best_at_least"] = x.placed.of_best
        rows.append(row | x.worlds)
        rows += [
            {
                "name": f"  ring{i + 1}", "link": r.link, "at_m": list(r.centre_m),
                "count": r.count, "tilt_deg": r.tilt_deg,
            }
            for i, r in enumerate(x.placed.rings if x.placed else ())
        ]  # fmt: skip
    worst = min(x.placed.of_best for x in layouts if x.placed is not None)
    checks = [Check("worth of the best there can be", worst, "", GREEDY, at_least=True)]
    return Report(f"placement of {wanted.sensors} sensors at most", seed, rows, checks)


def draw_curve(layouts: Sequence[Layout], path: Path) -> None:
    """What is seen, and touches and clearance where worlds were run, over the number of sensors."""
    from matplotlib.figure import Figure

    from app.plot import COLOURS, save

    placed = sorted((x for x in layouts if x.placed is not None), key=lambda x: x.sensors)
    panels = {SEEN: "worth of what is seen"}
    if placed[0].worlds:
        panels |= {"touches": "touches", "median_least_m": "median least distance [m]"}
    figure = Figure(figsize=(5.0 * len(panels), 3.6), layout="constrained")
    for i, (key, label) in enumerate(panels.items()):
        field: Any = figure.add_subplot(1, len(panels), i + 1)
        shown = [_figure(x, key) for x in placed]
        field.plot([x.sensors for x in placed], shown, "o-", color=COLOURS[0])
        for x in layouts:
            if x.placed is None:
                field.plot([x.sensors], [_figure(x, key)], "s", color=COLOURS[1], label=OWN)
        field.axvline(knee(layouts).sensors, color="0.7", lw=1, label="knee")
        field.set(xlabel="sensors", ylabel=label)
        field.grid(alpha=0.3)
        field.legend(fontsize="small")
    save(figure, path)


def _figure(x: Layout, key: str) -> float:
    return x.seen if key == SEEN else float(x.worlds[key])
