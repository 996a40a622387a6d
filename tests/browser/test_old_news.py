"""A page whose server says no more tells so itself, whatever the reason."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import open_window
from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as Window

pytestmark = pytest.mark.browser
ROOT = Path(__file__).parents[2]
OLD = ".flinch-old-notice"


@pytest.fixture(scope="module")
def server() -> Iterator["subprocess.Popen[str]"]:
    command = [sys.executable, "-m", "tests.lonely_page"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        yield process
        process.kill()


@pytest.fixture(scope="module")
def window(server: "subprocess.Popen[str]", browser: Browser) -> Iterator[Window]:
    assert server.stdout is not None
    window = open_window(browser, server.stdout.readline().strip())
    yield window
    window.close()


@pytest.fixture(autouse=True)
def at_home() -> None:
    """There is no arm here."""


def test_a_page_says_itself_that_it_is_old(server: "subprocess.Popen[str]", window: Window) -> None:
    notice = window.locator(OLD)
    window.wait_for_timeout(2500)  # nothing is said while all is well
    expect(notice).to_be_hidden()

    os.kill(server.pid, signal.SIGSTOP)  # it hangs, and its sockets stay open
    expect(notice).to_be_visible(timeout=20_000)
    expect(notice).to_contain_text("Nothing has come from the arm for")
    run = window.get_by_role("button", name="Run", exact=True)
    assert "grayscale" in run.evaluate("b => getComputedStyle(b).filter")
    run.click(force=True)
    window.keyboard.press("r")
    window.get_by_role("button", name="Stop", exact=True).click(force=True)

    os.kill(server.pid, signal.SIGCONT)
    expect(notice).to_be_hidden(timeout=20_000)
    assert server.stdout is not None
    # Run is not done late, when nobody thinks of it any more; Stop is
    assert server.stdout.readline().strip() == "stopped"
    run.click()
    assert server.stdout.readline().strip() == "running"

    server.kill()
    expect(notice).to_be_visible(timeout=20_000)
