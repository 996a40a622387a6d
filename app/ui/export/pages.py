"""Clips into a page: what is said around them, and what a gallery tells of it."""

import base64
from collections.abc import Sequence

import numpy as np

from app.control.registry import kind_of
from app.ui.export.document import Words, document
from app.ui.export.export import Exported
from app.ui.export.film import Arm
from app.ui.export.legend import Entry
from app.ui.export.poster import poster

ABOUT = (
    "The arm goes to its goal and gives way, with all of its body, to what its {sensors} sensors "
    "see. The arrow joins the closest point of the world and of the arm. {what}Drag in a scene to "
    "turn it, drag in the chart to go to a moment; the legend shows and hides."
)
OPEN_LOOP = (
    "The ghost is what another controller ({name}) would do in each moment of this very run: it is "
    "drawn where its command would bring the arm within half a second. "
)


def page_of(arm: Arm, clips: Sequence[Exported], origin: str) -> str:
    """One page; all clips are of the same arm. `origin`: when and by what it was recorded."""
    legend: dict[str, Entry] = {}
    for clip in clips:
        for entry in clip.entries:
            legend.setdefault(entry.label, entry)
    names = [clip.clip.name for clip in clips]
    ghosts = {label_of(c.first.ghost.mode) for c in clips if c.first.ghost is not None}
    what = OPEN_LOOP.format(name=", ".join(sorted(ghosts))) if ghosts else ""
    if len(clips) > 1:
        what += "Side by side: " + ", ".join(names) + ". "
    title = f"{arm.robot.title} · {arm.scene}" if arm.scene else arm.robot.title
    words = Words(
        title,
        ABOUT.format(sensors=len(arm.skin.sensors), what=what),
        f"{origin} Distances are what the skin perceives. This page works without a network.",
        {
            "title": title,
            "controllers": names,
            "seconds": round(max(clip.length for clip in clips), 2),
            "least": [least(clip) for clip in clips],
            "picture": "data:image/png;base64,"
            + base64.b64encode(poster(arm, clips[-1].nearest, clips[-1].eye)).decode("ascii"),
        },
    )
    return document([clip.clip for clip in clips], list(legend.values()), words)


def label_of(ghost: str) -> str:
    """A ghost's name, which begins with its mode, as people call the controller."""
    mode, comma, rest = ghost.partition(",")
    return f"{kind_of(mode).label}{comma}{rest}"


def least(clip: Exported) -> str:
    """The smallest distance of a clip, in words."""
    near = clip.curves.nearest
    if not np.isfinite(near.distance):
        return "nothing in sight"
    return f"{100.0 * near.distance:.0f} cm, {near.link}"
