"""The manual as the page shows it."""

from pathlib import Path

import pytest

from app.ui.panels.help_panel import FIRST, for_the_page

MANUAL = Path(__file__).parent.parent / "static_assets/manual"


def test_what_a_browser_cannot_open_stands_without_its_link():
    text = "# Title\n\n![a picture](../a.png)\nSee [other](other.md) and [the web](https://a.b).\n"
    assert for_the_page(text) == ("Title", "See *other* and [the web](https://a.b).")


@pytest.mark.parametrize("page", sorted(MANUAL.glob("*.md")), ids=lambda p: p.stem)
def test_every_page_of_the_manual_has_a_title_and_words(page):
    title, text = for_the_page(page.read_text("utf-8"))
    assert title != "Help" and len(text.split()) > 50 and "](../" not in text


def test_the_pages_that_come_first_are_there():
    assert [name for name in FIRST if not (MANUAL / f"{name}.md").exists()] == []
