"""Colours that can be read, told apart, and that cry only when something is the matter."""

import re
from itertools import combinations

import numpy as np
import pytest

from app.assets import asset_folder
from app.colours import POINT, REMEMBERED
from app.messages import Verdict
from app.ui.colours import ALARM, CALM, DANGER, GO, NEAR, QUIET, RGB, WAIT, WARN
from app.ui.panels.arm_panel import COLOUR, TINT

WHITE, DARK_PAGE = (255, 255, 255), (36, 36, 36)
READ = 4.5  # contrast that text needs: WCAG 2.2, 1.4.3
SHOWN = {"kept": POINT[Verdict.KEPT], "contact": POINT[Verdict.CONTACT], "remembered": REMEMBERED}
# how a dichromat's eye takes linear RGB: Vienot, Brettel and Mollon (1999)
BLIND = {
    "protan": [[0.1124, 0.8876, 0.0], [0.1124, 0.8876, 0.0], [0.0040, -0.0040, 1.0]],
    "deutan": [[0.2928, 0.7072, 0.0], [0.2928, 0.7072, 0.0], [-0.0223, 0.0223, 1.0]],
}


def linear(colour: RGB) -> np.ndarray:
    c = np.array(colour) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def contrast(a: RGB, b: RGB) -> float:
    low, high = sorted(float(linear(c) @ [0.2126, 0.7152, 0.0722]) for c in (a, b))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("colour", [GO, WAIT, DANGER, QUIET])
def test_white_on_a_button_is_easily_read(colour: RGB) -> None:
    assert contrast(colour, WHITE) >= READ


def test_a_refusal_is_easily_read() -> None:
    assert contrast(DANGER, WHITE) >= READ


@pytest.mark.parametrize("colour", {*COLOUR.values(), WARN})
def test_the_state_is_easily_read(colour: RGB) -> None:
    red, green, blue = (round(TINT / 100.0 * c) for c in colour)  # the rest is the text's black
    assert contrast((red, green, blue), WHITE) >= READ


def test_labels_and_main_buttons_are_easily_read() -> None:
    style = (asset_folder("static_assets") / "page" / "page.css").read_text("utf-8")

    def found(pattern: str) -> RGB:
        match = re.search(pattern, style)
        assert match is not None, pattern
        r, g, b = bytes.fromhex(match[1])
        return r, g, b

    dimmed = r'"{}"\] \{{ --mantine-color-dimmed: #(\w+)'
    assert contrast(found(dimmed.format("light")), WHITE) >= READ
    assert contrast(found(dimmed.format("dark")), DARK_PAGE) >= READ
    assert contrast(found(r"custom-filled: #(\w+)"), WHITE) >= READ


@pytest.mark.parametrize("kind", BLIND)
def test_what_stands_side_by_side_is_told_apart_by_colour_blind_eyes(kind: str) -> None:
    for group in (SHOWN, {"free": CALM, "acts": NEAR, "too near": WARN}):
        for a, b in combinations(group, 2):
            seen = [np.array(BLIND[kind]) @ linear(group[name]) for name in (a, b)]
            apart = np.linalg.norm(np.subtract(*(np.cbrt(np.maximum(c, 0.0)) for c in seen)))
            assert apart > 0.12, (a, b)


@pytest.mark.parametrize("verdict", sorted(POINT))
def test_points_do_not_look_like_an_alarm(verdict: Verdict) -> None:
    for alarm in (ALARM, WARN):
        assert np.linalg.norm(np.subtract(POINT[verdict], alarm)) > 60
