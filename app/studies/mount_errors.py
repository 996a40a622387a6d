"""`flinch experiment mounts`: does a calibration find what was drawn, and does it know how well?

The judge is the drawn truth: of each seed a skin glued on by hand, an arm that is not quite its
drawing, sensors whose zones err, stamps that are late, and a board that nobody has measured.
"""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from app.calibration.estimate import Estimate, estimate_mounts, stated_cov
from app.calibration.planes import planes_of
from app.calibration.session import Pace, gather, plan_motion, read_scene
from app.choices import build_robot_and_skin
from app.messages import Array
from app.report import Check, Report
from app.robot.mounts import with_mounts
from app.robot.posture import rotation_vector
from app.sensing.budget import read_budget
from app.sensing.truth import draw_truth
from app.setup import Setup
from app.timing import ManualClock

MEDIAN_MM, MEDIAN_DEG = 1.0, 0.15
MOST_MM, MOST_DEG, MOST_MS = 2.0, 0.25, 5.0
ENOUGH = 95.0  # [%] of the sensors within these
HONEST = 2.0  # mean square of errors over what was said of them


def mount_errors(
    setup: Setup, seeds: int, pace: Pace, told: Callable[[str], None] = lambda words: None
) -> Report:
    """Calibrate `seeds` simulated arms from setup.seed on, all by one plan."""
    robot, skin = build_robot_and_skin(setup)
    planes = planes_of(read_scene(setup))
    plan = plan_motion(robot, skin, setup, robot.home, pace)
    rows: list[dict[str, Any]] = []
    errors = []
    for seed in range(setup.seed, setup.seed + seeds):
        one = replace(setup, seed=seed)
        motion = gather(robot, skin, one, ManualClock(), pace, lambda share: None, plan)
        begin = perf_counter()
        found = estimate_mounts(robot, skin, planes, motion)
        truth = draw_truth(robot, skin, read_budget(setup.world), seed)
        true = np.array([s.T_link_sensor for s in truth.skin.sensors])
        believed = with_mounts(skin, found.mounts, robot)
        error = off_by(np.array([s.T_link_sensor for s in believed.sensors]), true)
        errors.append(np.column_stack((*size_of(error), normalised(error, found))))
        late = 1e3 * (found.after.late - truth.late)
        rows.append(
            {"name": f"seed {seed}"} | _row(errors[-1], late, found, plan.seconds)
            | {"fit_s": perf_counter() - begin}
        )  # fmt: skip
        told("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else str(v)
                       for k, v in rows[-1].items()))  # fmt: skip
    return Report("mounts", setup.seed, rows, _checks(np.concatenate(errors), rows))


def off_by(believed: Array, true: Array) -> Array:
    """(K, 6) [m, rad] from where sensors are believed to be (K, 4, 4) to where they are."""
    T = np.linalg.inv(believed) @ true
    return np.array([[*t[:3, 3], *rotation_vector(t[:3, :3])] for t in T])


def size_of(error: Array) -> tuple[Array, Array]:
    """(K,) [mm] and (K,) [deg] of errors (K, 6)."""
    position = 1e3 * np.linalg.norm(error[:, :3], axis=1)
    return position, np.degrees(np.linalg.norm(error[:, 3:], axis=1))


def normalised(error: Array, found: Estimate) -> Array:
    """(K,) mean square of each sensor's six errors over their covariance; 1 on the average."""
    cov = stated_cov(found.after)
    return np.asarray(np.einsum("ki,kij,kj->k", error, np.linalg.inv(cov), error) / 6)


def _row(errors: Array, late: float, found: Estimate, seconds: float) -> dict[str, Any]:
    mm, deg, square = errors.T
    unsure = sum(bool(m.unsure) for m in found.mounts.sensor)
    return {
        "median_mm": float(np.median(mm)), "p95_mm": float(np.quantile(mm, 0.95)),
        "median_deg": float(np.median(deg)), "p95_deg": float(np.quantile(deg, 0.95)),
        "late_off_ms": late, "normalised": float(square.mean()), "unsure": unsure,
        "motion_s": seconds,
    }  # fmt: skip


def _checks(errors: Array, rows: list[dict[str, Any]]) -> list[Check]:
    mm, deg, square = errors.T
    late = np.abs([r["late_off_ms"] for r in rows])
    timely = np.repeat(late <= MOST_MS, len(mm) // len(rows))
    within = 100 * float(((mm <= MOST_MM) & (deg <= MOST_DEG) & timely).mean())
    name = f"sensors within {MOST_MM:g} mm, {MOST_DEG:g} deg and {MOST_MS:g} ms"
    return [
        Check("median error of position", float(np.median(mm)), "mm", MEDIAN_MM),
        Check("median error of angle", float(np.median(deg)), "deg", MEDIAN_DEG),
        Check(name, within, "%", ENOUGH, at_least=True),
        Check("mean square of normalised errors", float(square.mean()), "", HONEST),
        Check("longest motion", max(r["motion_s"] for r in rows), "s", 300.0),
    ]
