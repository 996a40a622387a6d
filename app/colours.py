"""Colours that mean something, once: RGB, 0..255. Chosen to stay apart for colour-blind eyes."""

from app.messages import Verdict

RGB = tuple[int, int, int]

CALM: RGB = (46, 139, 87)
WARN: RGB = (230, 159, 0)
ALARM: RGB = (204, 51, 34)
GREY: RGB = (130, 135, 142)
KNOWN: RGB = (95, 104, 115)  # learned cubes
REMEMBERED: RGB = (0, 158, 115)
POINT: dict[Verdict, RGB] = {
    Verdict.KEPT: (0, 114, 189),
    Verdict.SELF: (120, 60, 130),
    Verdict.BEHIND: (170, 80, 170),
    Verdict.STATIC: (130, 135, 142),
    Verdict.BAD_STATUS: (150, 140, 40),
    Verdict.OUT_OF_RANGE: (120, 94, 60),
    Verdict.STALE: (150, 110, 170),
    Verdict.GHOST: (86, 180, 233),
    Verdict.CONTACT: (134, 0, 104),
}


def activation_colour(activation: float) -> RGB:
    """From calm to alarm in five steps: each new colour rebuilds a material in the browser."""
    share = round(min(max(activation, 0.0), 1.0) * 4) / 4
    low, high, t = (CALM, WARN, share * 2) if share <= 0.5 else (WARN, ALARM, share * 2 - 1)
    r, g, b = (round(a + (z - a) * t) for a, z in zip(low, high, strict=True))
    return (r, g, b)


def css(colour: RGB) -> str:
    """The colour as `#rrggbb`."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
