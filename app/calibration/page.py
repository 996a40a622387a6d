"""The calibration as a page that needs nothing but itself: what was wrong before, what is left.

A picture a sensor: residuals over distance, grey as laid out, blue as found; and its figures.
"""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.calibration.estimate import Estimate
from app.calibration.fit import Fit
from app.page import Html, sheet, table, write_sheet
from app.robot.mounts import MountTable

WIDTH, HEIGHT, LEFT, BELOW = 250, 130, 34, 16
DOTS = 160  # of a picture and colour
FAR, OFF = 2.0, 0.04  # [m] of the picture's axes: distance, residual to either side
STYLE = """
:root { --before: #a9b0b8; --after: #2563c4; }
@media (prefers-color-scheme: dark) { :root { --before: #59636f; --after: #7fb0ff; } }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); gap: 1rem; }
td:last-child, th:last-child { text-align: left; }
svg text { font: 10px system-ui, sans-serif; fill: var(--soft); }
.axis { stroke: var(--line); } .before, .after { fill: none; stroke-linecap: round;
  stroke-width: 2.2; } .before { stroke: var(--before); } .after { stroke: var(--after); }
"""


def write_page(path: Path, found: Estimate, title: str) -> None:
    """Write the page; ConfigError where that cannot be done."""
    write_sheet(path, page(found, title))


def page(found: Estimate, title: str) -> str:
    """The whole page."""
    body = (
        f'{_summary(found)}<h2>Residuals over distance</h2><p class="soft">Reported less '
        f"predicted, &plusmn;{1e3 * OFF:.0f} mm over 0 to {FAR:g} m: grey as laid out, blue as "
        f'found.</p><div class="grid">'
        f"{''.join(_figure(found, k) for k in range(found.skin.count))}</div>"
        f"<h2>Sensors</h2>{_table(found.mounts.sensor)}"
    )
    return sheet(title, Html(body), STYLE)


def spread(fit: Fit, rows: NDArray[np.bool_] | None = None) -> float:
    """[m] robust spread of a fit's residuals, of some rows (N,) or of all."""
    r = fit.residual[fit.weight > 0.0 if rows is None else rows & (fit.weight > 0.0)]
    return 1.4826 * float(np.median(np.abs(r))) if len(r) else float("nan")


def _summary(found: Estimate) -> str:
    m, before, after = found.mounts, spread(found.before), spread(found.after)
    lines = [
        f"{m.robot}, {m.layout}: {len(m.sensor)} sensors, "
        f"{int((found.after.weight > 0).sum())} returns.",
        f"Residuals {1e3 * before:.1f} mm as laid out, {1e3 * after:.1f} mm as found.",
        f"Stamps are {m.late_ms:.1f} &plusmn; {m.late_sigma_ms:.1f} ms later than the light.",
    ]
    out = "".join(f"<p>{line}</p>" for line in lines)
    moved = [s for s in m.sensor if s.place or s.rotation_deg is not None]
    for s in moved:
        out += f'<p class="warn">{escape(moved_words(s))}</p>'
    unsure = [s for s in m.sensor if s.unsure]
    for s in unsure:
        out += f'<p class="warn">{escape(s.name)} is unsure: {escape(s.unsure)}</p>'
    return out


def moved_words(s: MountTable) -> str:
    """A sensor that sits elsewhere, or otherwise, than the layout says."""
    words = [f"sits in the place of {s.place}"] if s.place else []
    if s.rotation_deg is not None:
        mirrored = "mirrored" if s.mirrored else "not mirrored"
        words.append(f"is mounted with rotation_deg = {s.rotation_deg}, {mirrored}")
    return f"{s.name} {' and '.join(words)}"


def _figure(found: Estimate, k: int) -> str:
    s = found.mounts.sensor[k]
    mine = found.before.rows.sensor == k, found.after.rows.sensor == k
    dots = (
        f'<path class="before" d="{_dots(found.before, mine[0])}"/>'
        f'<path class="after" d="{_dots(found.after, mine[1])}"/>'
    )
    middle = HEIGHT / 2
    axes = (
        f'<path class="axis" d="M{LEFT} 0V{HEIGHT}M{LEFT} {middle}H{WIDTH}"/>'
        f'<text x="0" y="10">+{1e3 * OFF:.0f}</text>'
        f'<text x="0" y="{HEIGHT}">-{1e3 * OFF:.0f}</text>'
        f'<text x="{WIDTH - 20}" y="{HEIGHT + 12}">{FAR:g} m</text>'
    )
    left = [1e3 * spread(found.before, mine[0]), 1e3 * spread(found.after, mine[1])]
    unsure = ' <span class="warn">unsure</span>' if s.unsure else ""
    return (
        f'<figure><svg viewBox="0 0 {WIDTH} {HEIGHT + BELOW}" role="img" '
        f'aria-label="Residuals of {escape(s.name)}">{axes}{dots}</svg><figcaption>'
        f"<b>{escape(s.name)}</b>{unsure} {left[0]:.1f} &rarr; {left[1]:.1f} mm"
        "</figcaption></figure>"
    )


def _dots(fit: Fit, rows: NDArray[np.bool_]) -> str:
    """A path of dots, evenly taken of some rows (N,)."""
    i = np.flatnonzero(rows & (fit.weight > 0.0))
    if len(i) > DOTS:
        i = i[np.linspace(0, len(i) - 1, DOTS).astype(np.intp)]
    x = LEFT + (WIDTH - LEFT) * np.clip(fit.rows.report[i] / FAR, 0.0, 1.0)
    y = HEIGHT / 2 * (1.0 - np.clip(fit.residual[i] / OFF, -1.0, 1.0))
    return "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True))


def _table(sensors: Sequence[MountTable]) -> Html:
    head = ("sensor", "x mm", "y mm", "z mm", "±", "turn x °", "y °", "z °", "±", "zones %", "")
    rows = []
    for s in sensors:
        zones = float(np.std(s.zone_percent)) if s.zone_percent else 0.0
        figures = [f"{v:+.2f}" for v in s.shift_mm] + [f"{s.sigma_mm:.2f}"]
        figures += [f"{v:+.2f}" for v in s.turn_deg] + [f"{s.sigma_deg:.2f}", f"{zones:.1f}"]
        words = moved_words(s) if s.place or s.rotation_deg is not None else ""
        words += f" unsure: {s.unsure}" if s.unsure else ""
        rows.append([s.name, *figures, words])
    return table(head, rows)
