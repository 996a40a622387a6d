"""Pictures of exported pages for the README: `python -m tests.gallery_pictures FROM TO`.

Each page is opened from disk in the browser of the tests, at the moment of its smallest distance.
"""

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from app.ui.export.gallery import INDEX, facts_of
from tests.conftest import CHROMIUM_FLAGS

SIZE = {"width": 1200, "height": 760}
PATIENCE = 600_000  # [ms]: three scenes are drawn by the processor alone
STILL = 25_000  # [ms] until light and shadow have come


def take(source: Path, target: Path) -> None:
    """A picture of every exported page of `source`."""
    target.mkdir(parents=True, exist_ok=True)
    pages = [p for p in sorted(source.glob("*.html")) if p.name != INDEX and facts_of(p)]
    found = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=CHROMIUM_FLAGS)
        for path in pages:
            window = browser.new_page(viewport=SIZE, color_scheme="light")
            window.set_default_timeout(PATIENCE)
            window.goto(f"{path.resolve().as_uri()}#t=0")
            window.wait_for_selector("body[data-ready]")
            window.evaluate("seek(facts.clips[0].nearest.time)")
            window.wait_for_timeout(STILL)
            picture = target / f"{path.stem}.jpg"
            window.screenshot(path=picture, type="jpeg", quality=82, timeout=PATIENCE)
            print(f"{picture}: {picture.stat().st_size / 1000:.0f} kB")
            window.close()
        browser.close()


if __name__ == "__main__":
    take(Path(sys.argv[1]), Path(sys.argv[2]))
