"""An index of exported pages: picture, title, length, controllers, smallest distances, link."""

import json
import re
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from app.assets import asset_folder
from app.errors import ConfigError

INDEX = "index.html"
FACTS = re.compile(r'<script type="application/json" id="facts">(.*?)</script>', re.S)
ABOUT = (
    "Runs of an arm that gives way with all of its body. Each opens as one page with its scene to "
    "turn and to play, and its distances below; none needs a network."
)


def write_index(folder: Path) -> int:
    """Write `folder`/index.html anew; the number of clips in it.

    Raises ConfigError for a folder without exported pages, and where it cannot be written.
    """
    if not folder.is_dir():
        raise ConfigError(f"{folder}: no such folder; give the one with the exported pages")
    found = [(path, facts_of(path)) for path in sorted(folder.glob("*.html"))]
    clips = [(path, facts) for path, facts in found if facts is not None]
    if not clips:
        raise ConfigError(f"{folder}: no exported page in it; write one with flinch export")
    page = (asset_folder("static_assets") / "export" / "gallery.html").read_text("utf-8")
    cards = "\n".join(card(path.name, facts) for path, facts in clips)
    page = page.replace("<!--about-->", escape(ABOUT)).replace("<!--clips-->", cards)
    try:
        (folder / INDEX).write_text(page, "utf-8")
    except OSError as e:
        raise ConfigError(f"{folder / INDEX}: cannot be written ({e.strerror})") from e
    return len(clips)


def facts_of(path: Path) -> dict[str, Any] | None:
    """What an exported page tells of itself; None of any other page."""
    found = FACTS.search(path.read_text("utf-8", errors="replace"))
    if found is None:
        return None
    try:
        index = json.loads(found[1]).get("index")
    except (ValueError, AttributeError):
        return None
    return index if isinstance(index, dict) and {"title", "least"} <= set(index) else None


def card(name: str, facts: dict[str, Any]) -> str:
    """One clip; what a page says is text here, and its picture no address but data."""
    picture = str(facts.get("picture", ""))
    shown = picture if picture.startswith("data:image/") else ""
    rows = "".join(
        f"<tr><th>{escape(str(who))}</th><td>{escape(str(near))}</td></tr>"
        for who, near in zip(facts.get("controllers", ()), facts["least"], strict=False)
    )
    seconds = facts.get("seconds", 0.0)
    length = f"{seconds:.1f} s" if isinstance(seconds, int | float) else "unknown"
    return (
        f'<li><a href="{escape(quote(name))}">'
        f'<img src="{escape(shown)}" alt="{escape(str(facts["title"]))}">'
        f"<h2>{escape(str(facts['title']))}</h2>"
        f"<table><tr><th>Length</th><td>{length}</td></tr>{rows}</table></a></li>"
    )
