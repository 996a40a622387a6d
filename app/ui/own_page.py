"""What Flinch adds to viser's page: a script and a style of its own, put in as it is handed out.

What the server can no longer say, since it hangs or the line is dead, only the page itself can.
Controls of viser hold no script, so it goes into the one HTML file that the page is.
"""

import gzip
from functools import lru_cache

from websockets.http11 import Response

from app.assets import asset_folder
from app.errors import ServerError

BEFORE = b"</head>"
SCRIPTS = ("watch.js", "tour.js")
STYLE = "page.css"
MARK = "flinch-page"  # an attribute that tells that it is in place


def dress(response: Response) -> None:
    """Put script and style into a page; any other file stays as it is."""
    if not response.headers.get("Content-Type", "").startswith("text/html"):
        return
    packed = response.headers.get("Content-Encoding") == "gzip"
    response.body = dressed(bytes(response.body), packed)
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))


@lru_cache(maxsize=4)
def dressed(page: bytes, packed: bool) -> bytes:
    """The page with what is added; `packed`: gzip, in and out."""
    whole = gzip.decompress(page) if packed else page
    head, mark, rest = whole.rpartition(BEFORE)
    if not mark:
        raise ServerError(
            "viser's page has no head to put the page's own script into; install the versions in "
            "constraints.txt"
        )
    whole = head + added().encode() + mark + rest
    return gzip.compress(whole, 6) if packed else whole


def added() -> str:
    """The script and the style, as they stand in the page."""
    folder = asset_folder("static_assets") / "page"
    style = (folder / STYLE).read_text("utf-8")
    scripts = "\n".join((folder / name).read_text("utf-8") for name in SCRIPTS)
    return f"<style>{style}</style><script data-{MARK}>{scripts}</script>"
