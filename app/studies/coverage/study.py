"""Coverage of a robot and a skin over postures, as a report and as files."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.coverage.look import Look, Subject, look
from app.coverage.tally import WITHIN, Tally
from app.coverage.thrown import throw
from app.coverage.wedges import wedges
from app.errors import ConfigError
from app.messages import Array
from app.report import Check, Report
from app.robot.blind import blind_words
from app.studies.coverage.portions import Plan, subject_for, tallied

AGREED = 0.97  # of spheres thrown, those that are seen where it was predicted


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What came of it: the sums, the last look and the report."""

    tally: Tally
    last: Look
    report: Report


def cover(
    plan: Plan, q: Array, what: str, check: int, seed: int, jobs: int = 1,
    told: Callable[[int], None] = lambda steps: None,
) -> Found:  # fmt: skip
    """Look at every posture of q (m, n), and throw `check` spheres at the last; `told` how many
    steps of these are done."""
    tally = tallied(plan, q, jobs, told)
    subject = subject_for(plan)
    posture = subject.robot.posture(q[-1])
    last = look(subject, posture)
    hidden = float((tally.sums.hidden == tally.sums.looks).sum())
    checks = [Check("sensors that look into the arm in all postures", hidden, "", 0.0)]
    if check:
        thrown = throw(subject, last, posture, check, seed, lambda: told(1))
        share = float(thrown.agreed.mean())
        checks.append(Check("thrown and seen where predicted", share, "", AGREED, at_least=True))
    rows = [*tally.rows(), tally.space_row(), *wedge_rows(subject, last), *tally.sensor_rows()]
    return Found(tally, last, Report(what, seed, rows, checks))


def wedge_rows(subject: Subject, seen: Look) -> list[dict[str, Any]]:
    """A row each ring: where the wedges between its neighbours close, most and least, at the last
    posture."""
    found = wedges(subject, seen)
    rows = []
    for ring in dict.fromkeys(w.first.rpartition("-")[0] for w in found):
        mine = [w for w in found if w.first.rpartition("-")[0] == ring]
        rows.append({
            "name": f"wedges of {ring}",
            "count": len(mine),
            "closes_m": max(w.closes for w in mine),
            "closes_least_m": min(w.closes for w in mine),
            "closes_with_all_m": max(w.with_all for w in mine),
        })  # fmt: skip
    return rows


def warnings(subject: Subject) -> tuple[str, ...]:
    """What a person should know of the layout: sensors that see nothing but the arm."""
    return blind_words(subject.robot, subject.skin)


def write_patches(tally: Tally, path: Path) -> None:
    """A line a patch, in the frame of its link: ConfigError where that cannot be done."""
    patches, links = tally.subject.patches, tally.subject.robot.links
    sums, ways = tally.sums, np.maximum(tally.sums.open, 1.0)
    head = ["link", "x_m", "y_m", "z_m", "nx", "ny", "nz", "area_m2", "ways"]
    head += [f"seen_{100 * d:.0f}cm" for d in WITHIN] + ["gap_m", "worst_gap_m", "time_s"]
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            out = csv.writer(file)
            out.writerow(head)
            for p in range(len(patches.link)):
                if not sums.open[p]:
                    continue  # nothing can come to what is covered
                figures = [
                    *patches.point[p], *patches.normal[p], patches.area[p], sums.open[p],
                    *(sums.seen[:, p] / ways[p]), sums.gap[p] / ways[p], sums.worst[p],
                    sums.time[p] / ways[p],
                ]  # fmt: skip
                out.writerow([links[patches.link[p]], *(f"{v:.6g}" for v in figures)])
    except OSError as e:
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); give another --out") from e
