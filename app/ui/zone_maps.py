"""Pictures of what sensors see: a sheet of all of them, and one of a single sensor with numbers.

They are SVG: a few paths, one a colour, made of runs of like zones, 8 letters each; 1920 zones come
to some 25 kB where an element for each would be a hundred. Zones without a believed distance are
hatched, those with nothing there are left empty, and what is thrown away has a corner in the colour
that its points have in the scene.

Distances are coloured by viridis (Smith and van der Walt, matplotlib 2015), whose steps look alike
to every eye: near is bright. The scale is the square root of the distance, since near matters.
"""

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, Verdict
from app.robot.skin import Skin
from app.ui.colours import CHOSEN, POINT, css

VIRIDIS = (
    "440154", "482475", "414487", "355f8d", "2a788e", "21918c", "22a884", "44bf70", "7ad151",
    "bddf26", "fde725",
)  # fmt: skip
STEPS, FARTHEST = 33, 4.0  # colours; [m] the darkest
MARKS = (0.05, 0.25, 0.6, 1.0, 2.0, 4.0)  # [m] beneath the scale
HATCHED, NOTHING = STEPS, STEPS + 1  # classes of a zone beside those with a colour
ACROSS = 6  # maps in a row of the sheet
CELL, MAP, LABEL = 60, 50, 13  # pixels of a map with its margin, of the map, and of its name
WIDE = 348  # pixels of the single picture
BAD = np.zeros(len(Verdict), dtype=bool)  # by verdict: is its distance worth nothing?
BAD[[Verdict.BAD_STATUS, Verdict.OUT_OF_RANGE, Verdict.STALE, Verdict.EMPTY]] = True
THROWN = tuple(v for v in Verdict if v in POINT and v is not Verdict.KEPT)
HATCH = (
    '<pattern id="{0}" width="4" height="4" patternUnits="userSpaceOnUse" '
    'patternTransform="rotate(45)"><path d="M1 0v4" stroke="currentColor" stroke-opacity=".55" '
    'stroke-width="1.2"/></pattern>'
)


def _mixed() -> tuple[str, ...]:
    """The scale's colours from far to near, between those of the table."""
    table = np.array([[int(h[i : i + 2], 16) for i in (0, 2, 4)] for h in VIRIDIS], dtype=float)
    at = np.linspace(0.0, len(VIRIDIS) - 1.0, STEPS)
    rgb = np.stack([np.interp(at, np.arange(len(VIRIDIS)), c) for c in table.T], axis=1)
    return tuple("#{:02x}{:02x}{:02x}".format(*np.round(c).astype(int)) for c in rgb)


COLOURS = _mixed()


def levels(distance: Array, verdict: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(S,) which colour each zone has, or HATCHED, or NOTHING; distance (S,) [m], maybe NaN."""
    near = 1.0 - np.sqrt(np.clip(np.nan_to_num(distance), 0.0, FARTHEST) / FARTHEST)
    level = np.round(near * (STEPS - 1)).astype(np.int64)
    level[np.isnan(distance)] = NOTHING
    level[BAD[verdict]] = HATCHED
    return level


class Sheet:
    """The small maps of all sensors, so many in a row, in an order that may change."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin
        self.rows = -(-skin.count // ACROSS)
        first, grid = skin.first, skin.grid
        slot = np.arange(skin.slots)
        column = (slot - first[skin.sensor_of]) % grid[skin.sensor_of, 1]
        # a run of like zones ends with a row of a sensor
        self._ends = np.append(column[1:] == 0, True)
        self.arrange(range(skin.count))

    def arrange(self, order: Sequence[int]) -> None:
        """Show the sensors in this order from now on: indices, every one once."""
        self.order = tuple(order)
        self._middle = [""] * self._skin.slots  # how a stroke along a zone begins
        self._corner = [""] * self._skin.slots  # a triangle in its upper left
        for place, k in enumerate(self.order):
            x, y = origin(place)
            rows, columns = self._skin.grid[k].tolist()
            wide, high = MAP / columns, MAP / rows
            leg = max(min(wide, high) * 0.55, 1.5)
            for zone in range(rows * columns):
                i, j = divmod(zone, columns)
                slot = int(self._skin.first[k]) + zone
                left, top = x + j * wide, y + i * high
                self._middle[slot] = f"M{left:.4g} {top + high / 2:.4g}"
                self._corner[slot] = f"M{left:.4g} {top:.4g}h{leg:.2g}l-{leg:.2g} {leg:.2g}z"

    def svg(
        self, distance: Array, verdict: NDArray[np.uint8], dots: Sequence[str], chosen: int
    ) -> str:
        """The picture of distances and verdicts (S,). dots: a CSS colour for each sensor that
        needs a look, else an empty text."""
        skin, level = self._skin, levels(distance, verdict)
        ends = self._ends.copy()
        ends[:-1] |= level[1:] != level[:-1]
        last = np.flatnonzero(ends)
        begin = np.append(0, last[:-1] + 1)
        paths: dict[tuple[int, float], list[str]] = {}
        owners = skin.sensor_of[begin]
        high = MAP / skin.grid[owners, 0]
        long = (last - begin + 1) * MAP / skin.grid[owners, 1]
        for b, c, h, w in zip(
            begin.tolist(), level[begin].tolist(), high.tolist(), long.tolist(), strict=True
        ):
            if c != NOTHING:
                paths.setdefault((c, h), []).append(f"{self._middle[b]}h{w:g}")
        body = "".join(
            f'<path stroke="{_paint(c, "zones-hatch")}" stroke-width="{h:g}" d="{"".join(d)}"/>'
            for (c, h), d in sorted(paths.items())
        )
        tall = self.rows * (CELL + LABEL)
        return (
            f'<svg viewBox="0 0 {ACROSS * CELL} {tall}" fill="none" style="display:block;width:100%'
            f'"><defs>{HATCH.format("zones-hatch")}</defs>{self._grounds()}{body}'
            f"{self._corners(verdict)}{self._marks(dots, chosen)}</svg>"
        )

    def _grounds(self) -> str:
        """What a zone with nothing there shows."""
        d = "".join(f"M{x} {y}h{MAP}v{MAP}h-{MAP}z" for x, y in map(origin, range(len(self.order))))
        return f'<path fill="currentColor" fill-opacity=".09" d="{d}"/>'

    def _corners(self, verdict: NDArray[np.uint8]) -> str:
        out = []
        for v in THROWN:
            mine = np.flatnonzero(verdict == v).tolist()
            if mine:
                d = "".join([self._corner[slot] for slot in mine])
                out.append(f'<path fill="{css(POINT[v])}" d="{d}"/>')
        return "".join(out)

    def _marks(self, dots: Sequence[str], chosen: int) -> str:
        """A dot at each sensor that needs a look, and a frame round the chosen one."""
        out = []
        for place, k in enumerate(self.order):
            x, y = origin(place)
            if dots[k]:
                out.append(
                    f'<circle cx="{x + MAP}" cy="{y}" r="5" fill="{dots[k]}" stroke="#fff" '
                    'stroke-width="1.5"/>'
                )
            if k == chosen:
                out.append(
                    f'<rect x="{x - 3}" y="{y - 3}" width="{MAP + 6}" height="{MAP + 6}" rx="3" '
                    f'stroke="{css(CHOSEN)}" stroke-width="2.5"/>'
                )
        return "".join(out)


def origin(place: int) -> tuple[int, int]:
    """Pixel of the upper left of the map at a place of the sheet."""
    row, column = divmod(place, ACROSS)
    return column * CELL + (CELL - MAP) // 2, row * (CELL + LABEL) + 6


def one(
    distance: Array, verdict: NDArray[np.uint8], grid: tuple[int, int], chosen: int = -1
) -> str:
    """A single sensor's zones (n,), with the distance in centimetres in each that has room for it.

    chosen: a zone with a frame round it, -1 for none.
    """
    rows, columns = grid
    side = WIDE / max(rows, columns)
    out = [
        f'<svg viewBox="0 0 {side * columns:g} {side * rows:g}" fill="none" data-zones="{rows}x'
        f'{columns}" style="display:block;width:100%"><defs>{HATCH.format("zone-hatch")}</defs>'
    ]
    level = levels(distance, verdict)
    for zone, (c, d, v) in enumerate(
        zip(level.tolist(), distance.tolist(), verdict.tolist(), strict=True)
    ):
        i, j = divmod(zone, columns)
        x, y = j * side, i * side
        paint = 'fill="currentColor" fill-opacity=".09"'
        if c != NOTHING:
            paint = f'fill="{_paint(c, "zone-hatch")}"'
        inner = f'x="{x:.4g}" y="{y:.4g}" width="{side - 1:.4g}" height="{side - 1:.4g}"'
        out.append(f"<rect {inner} {paint}/>")
        if v in THROWN:
            leg = side * 0.3
            corner = f"M{x:.4g} {y:.4g}h{leg:.3g}l-{leg:.3g} {leg:.3g}z"
            out.append(f'<path fill="{css(POINT[Verdict(v)])}" d="{corner}"/>')
        if d == d and side > 16:  # NaN is not itself
            ink = "#fff" if c < STEPS * 0.6 else "#111" if c < STEPS else "currentColor"
            out.append(
                f'<text x="{x + side / 2:.4g}" y="{y + side * 0.62:.4g}" text-anchor="middle" '
                f'font-size="{min(side * 0.34, 26):.3g}" fill="{ink}">{100.0 * d:.0f}</text>'
            )
        if zone == chosen:
            out.append(f'<rect {inner} stroke="{css(CHOSEN)}" stroke-width="3.5"/>')
    return "".join([*out, "</svg>"])


def scale() -> str:
    """The scale of the distances, and what corner and hatch mean, as HTML."""
    stops = ",".join(reversed(COLOURS[::4]))
    at = [100.0 * np.sqrt(m / FARTHEST) for m in MARKS]
    marks = "".join(
        f'<span style="position:absolute;left:{x:.0f}%;transform:translateX(-{x:.0f}%)">'
        f"{100.0 * m:.0f}</span>"
        for x, m in zip(at, MARKS, strict=True)
    )
    corners = " ".join(
        f'<span style="white-space:nowrap"><i style="display:inline-block;width:8px;height:8px;'
        f'background:{css(POINT[v])};clip-path:polygon(0 0,100% 0,0 100%)"></i> '
        f"{escape(v.name.lower().replace('_', ' '))}</span>"
        for v in THROWN
    )
    return (
        f'<div style="padding:0 10px;font-size:0.75em;line-height:1.45">'
        f'<div style="height:9px;background:linear-gradient(90deg,{stops})"></div>'
        f'<div style="position:relative;height:1.5em">{marks}</div>'
        f"cm. Pale: nothing there. Hatched: no use. Corner: why it was thrown away: {corners}</div>"
    )


def _paint(level: int, hatch: str) -> str:
    return COLOURS[level] if level < STEPS else f"url(#{hatch})"
