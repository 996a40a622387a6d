"""The manual on the page: the pages of `static_assets/manual`, closed but for the first.

Folders open in one browser alone, so that everybody reads what they want, watchers too.
"""

import re
from pathlib import Path

import viser

FIRST = (
    "first-ten-minutes", "what-you-see", "why-did-it-not-give-way", "your-arm-your-skin",
    "real-skin", "record-replay-compare",
)  # fmt: skip
PICTURE = re.compile(r"^!\[.*?\]\(.*?\)\n", re.M)  # megabytes that the page has live
LINK = re.compile(r"\[([^]]+)\]\((?!https?:)[^)]*\)")  # to files that no browser can open here
TITLE = re.compile(r"\A# (.+)\n")


def show_help(server: viser.ViserServer, folder: Path) -> None:
    """A folder for each page of the manual in `folder`, in the order in which they are wanted."""
    pages = {path.stem: path for path in sorted(folder.glob("*.md"))}
    for i, name in enumerate([*FIRST, *(n for n in pages if n not in FIRST)]):
        title, text = for_the_page(pages[name].read_text("utf-8"))
        with server.gui.add_folder(title, expand_by_default=i == 0):
            server.gui.add_markdown(text)


def for_the_page(text: str) -> tuple[str, str]:
    """The title of a page of the manual, and what is below it without pictures and dead links."""
    match = TITLE.match(text)
    title = match[1] if match else "Help"
    return title, LINK.sub(r"*\1*", PICTURE.sub("", TITLE.sub("", text))).strip()
