"""One page of everything: viser's viewer, the scenes, the facts and our player, in one file.

The viewer is there once, however many scenes there are; each scene is played in a frame of its
own. The page asks nobody for anything: its own policy forbids it.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from app.assets import asset_folder
from app.errors import ServerError
from app.ui.colours import css
from app.ui.export.legend import Entry

SCENE = re.compile(r'(?<=window\.__VISER_EMBED_DATA__=)"([A-Za-z0-9+/=]+)"')
LIGHT = "window.__VISER_EMBED_CONFIG__={darkMode:false}"


@dataclass(frozen=True)
class Clip:
    """One run in a document: its name, what its film and its curves became."""

    name: str
    scene: str  # viser's page
    facts: dict[str, Any]  # see `app.ui.export.curves.as_facts`


@dataclass(frozen=True)
class Words:
    """What is said around the scenes: title; one paragraph on top; one line below; for an index."""

    title: str
    about: str
    foot: str = ""
    index: dict[str, Any] | None = None  # what a gallery tells of the page


def document(clips: Sequence[Clip], legend: Sequence[Entry], words: Words) -> str:
    """The page as text. `ServerError` where viser's page is not as it was."""
    parts = [SCENE.split(clip.scene) for clip in clips]
    if any(len(p) != 3 for p in parts):
        raise ServerError(
            "viser's page keeps its scene in another way than is known here; install the version "
            "in constraints.txt"
        )
    before, _, after = parts[0]
    facts = {
        "title": words.title,
        "about": words.about,
        "foot": words.foot,
        "index": words.index,
        "clips": [{"name": clip.name, **clip.facts} for clip in clips],
        "legend": [asdict(replace(e)) | {"colours": list(map(css, e.colours))} for e in legend],
    }
    scenes = "\n".join(
        f'<script type="text/plain" id="scene-{k}">{scene}</script>'
        for k, (_, scene, _) in enumerate(parts)
    )
    folder = asset_folder("static_assets") / "export"
    page, style, player = (
        (folder / name).read_text("utf-8") for name in ("page.html", "page.css", "player.js")
    )
    fills = {
        "/*style*/": style,
        "/*facts*/": embedded(facts),
        "/*viewer*/": embedded({"before": before, "after": after}),
        "<!--scenes-->": scenes,
        "/*player*/": player,
    }
    pattern = re.compile("|".join(map(re.escape, fills)))
    return pattern.sub(lambda found: fills[found[0]], page)


def embedded(value: Any) -> str:
    """JSON that cannot end the element it stands in."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
