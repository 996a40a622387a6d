"""Layouts that were placed: written, looked at as they are worn, and tried in random worlds."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.coverage.sites import LENS
from app.errors import ConfigError
from app.messages import Array
from app.page import write_sheet
from app.report import Check, Report
from app.robot.draft_text import Ring, layout_text
from app.robot.skin_file import RingTable
from app.setup import Setup
from app.studies.coverage.placement import Placed, Wanted, place, worn
from app.studies.engines import Means, engine_of
from app.studies.study import Study, run_study
from app.studies.trial import TrialResult
from app.studies.warm_up import warmed

WORLDS, CONDITION = "worlds", "QP"
OWN_ROBOT = "ur10e"  # whose random worlds there are
OURS = "the robot's own layout"
GREEDY = 1.0 - 1.0 / np.e  # what a greedy choice is worth at least, of the best, by theory


class PlacedLayout(NamedTuple):
    """A layout that was placed for a horizon [m], and its file."""

    horizon: float
    placed: Placed
    path: Path


class Trials(NamedTuple):
    """What came of random worlds, a row each layout, and the layout that touched least."""

    rows: list[dict[str, object]]
    best: PlacedLayout


def placed_layouts(
    wanted: Wanted, horizons: Sequence[float], q: Array, folder: Path, jobs: int,
    told: Callable[[], None],
) -> list[PlacedLayout]:  # fmt: skip
    """Place for each horizon at every second posture of q (m, n), and write the layouts."""
    out = []
    for horizon in horizons:
        placed = place(replace(wanted, horizon=horizon), q[::2], jobs, told)
        path = folder / f"placed-{100 * horizon:.0f}cm.toml"
        write_sheet(path, text_of(placed.rings))
        out.append(PlacedLayout(horizon, placed, path))
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


def tried(
    layouts: Sequence[PlacedLayout], setup: Setup, worlds: int, seed: int, engine: str, jobs: int
) -> Trials:
    """Run the QP in the same random worlds with each layout, and with the robot's own."""
    if setup.robot != OWN_ROBOT or setup.urdf:
        raise ConfigError(f"--worlds are random worlds of the {OWN_ROBOT}; leave it out for others")
    rows: list[dict[str, object]] = []
    run = engine_of(engine, Means(jobs, None, None))
    ranks = []
    for name, skin in [(OURS, setup.skin), *((p.path.stem, str(p.path)) for p in layouts)]:
        study = Study(WORLDS, (CONDITION,), worlds, None, seed, skin=skin)
        results = run_study(study, warmed(run) if jobs > 1 else run)
        row = world_row(name, results)
        rows.append(row)
        ranks.append((row["touches"], -float(str(row["median_least_m"]))))
    best = min(range(len(layouts)), key=lambda i: ranks[i + 1])
    return Trials(rows, layouts[best])


def world_row(name: str, results: Sequence[TrialResult]) -> dict[str, object]:
    """Touches, those that nobody saw coming, and the median of the least distances."""
    good = [r.figures for r in results if not r.fault]
    touches = [f["touch"] for f in good if f["touch"]]
    least = [f["least"] for f in good if np.isfinite(f["least"])]
    return {
        "name": f"worlds, {name}",
        "worlds": len(good),
        "touches": len(touches),
        "unseen": sum(t["cause"] == "not seen" for t in touches),
        "median_least_m": float(np.median(least)) if least else float("nan"),
    }


def report_of(
    wanted: Wanted, own: Setup, layouts: Sequence[PlacedLayout], others: Array,
    trials: Trials | None,
) -> Report:  # fmt: skip
    """Rings, what they are worth at postures that had no part in the choice, and the trials."""
    rows: list[dict[str, object]] = []
    has_own = own.skin or not own.urdf
    if has_own:
        seen = worn(own, others, wanted)
        rows.append({"name": OURS, "worth_other_postures": seen})
    for layout in layouts:
        p = layout.placed
        seen = worn(replace(own, skin=str(layout.path)), others, wanted)
        rows.append({
            "name": layout.path.stem,
            "sensors": sum(r.count for r in p.rings),
            "worth_other_postures": seen,
            "worth_chosen_on": p.choice.value / p.whole,
            "of_the_best_at_least": p.of_best,
        })  # fmt: skip
        rows += [
            {
                "name": f"  ring{i + 1}", "link": r.link, "at_m": list(r.centre_m),
                "count": r.count, "tilt_deg": r.tilt_deg,
            }
            for i, r in enumerate(p.rings)
        ]  # fmt: skip
    rows += trials.rows if trials else []
    worst = min(layout.placed.of_best for layout in layouts)
    checks = [Check("worth of the best there can be", worst, "", GREEDY, at_least=True)]
    return Report(f"placement of {wanted.sensors} sensors", 0, rows, checks)
