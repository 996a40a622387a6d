"""A calibration as a report: one row a sensor."""

from typing import Any

from app.calibration.estimate import Estimate
from app.calibration.page import moved_words, spread
from app.report import Report


def report_of(found: Estimate, seed: int) -> Report:
    """Rows for a person or for --json."""
    m = found.mounts
    rows: list[dict[str, Any]] = [
        {
            "name": "stream", "late_ms": m.late_ms, "late_sigma_ms": m.late_sigma_ms,
            "residual_before_mm": 1e3 * spread(found.before),
            "residual_after_mm": 1e3 * spread(found.after),
        }
    ]  # fmt: skip
    for k, s in enumerate(m.sensor):
        mine = [f.rows.sensor == k for f in (found.before, found.after)]
        rows.append(
            {
                "name": s.name, "shift_mm": list(s.shift_mm), "turn_deg": list(s.turn_deg),
                "sigma_mm": s.sigma_mm, "sigma_deg": s.sigma_deg,
                "residual_before_mm": 1e3 * spread(found.before, mine[0]),
                "residual_after_mm": 1e3 * spread(found.after, mine[1]),
                "mounted": moved_words(s) if s.place or s.rotation_deg is not None else "",
                "unsure": s.unsure,
            }
        )  # fmt: skip
    return Report("calibrate-mounts", seed, rows)
