"""The report of a study of coverage as one page."""

import base64
from pathlib import Path
from typing import Any

from app.page import Html, html, sheet, table
from app.studies.coverage.study import Found

STYLE = "img { width: 100%; height: auto; background: #fff; border-radius: .3rem; }"
MEANINGS = {
    "seen_20cm": "of the ways to a patch that the arm does not bar itself, those on which what "
    "comes was seen before it was 20 cm from the patch; weighted by area",
    "watched_20cm": "share of the points 20 cm over the skin that a sensor sees, of those in the "
    "open; a thing that was seen coming may be lost from sight there",
    "twice_20cm": "the same for two sensors at least, so that one may fail",
    "gap_m": "mean distance from the patch at which what comes is first seen",
    "time_s": "mean time from when the host knows of it to contact",
    "blind_area": "share of the area to which something can come unseen to within 10 cm, from "
    "some direction; mean over postures",
    "never_seen": "share of the area to which nothing is ever seen coming",
    "costs_20cm": "what the loss of this sensor alone takes from seen_20cm of all that moves",
    "lost_cone": "share of the sensor's cone that the arm takes or hides",
    "hidden": "share of the postures in which most of its zones end less than 10 cm ahead, on the "
    "arm itself",
    "closes_m": "how far out from the lenses the wedge between two neighbours closes",
}


def page(found: Found, picture: Path, told: tuple[str, ...]) -> str:
    """The whole page."""
    report = found.report
    source = base64.b64encode(picture.read_bytes()).decode()
    groups: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in report.rows:
        groups.setdefault(tuple(row), []).append(row)
    tables = [
        table(keys, [[_cell(v) for v in row.values()] for row in rows])
        for keys, rows in groups.items()
    ]
    checks = [(c.name, f"{c.value:.4g}", f"{c.limit:g}", "ok" if c.ok else "MISSED")
              for c in report.checks]  # fmt: skip
    words = "".join(f'<p class="warn">{html(w)}</p>' for w in told)
    meanings = "".join(f"<p><b>{k}</b>: {html(v)}.</p>" for k, v in MEANINGS.items())
    image = f'<img alt="the arm from four sides" src="data:image/png;base64,{source}">'
    parts = [words, image, *tables, table(("check", "value", "limit", ""), checks), meanings]
    return sheet(f"Flinch: {report.what}", Html("".join(parts)), STYLE)


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
