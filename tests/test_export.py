"""A run becomes one page: what is in it, what it says, and what it never asks for."""

import json
import re
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.errors import ConfigError
from app.robot.model import Robot
from app.ui.export.curves import Curves
from app.ui.export.document import Words, document
from app.ui.export.export import Exported, Part, exported
from app.ui.export.eye import choose_eye, visible
from app.ui.export.film import Arm
from app.ui.export.gallery import FACTS, write_index
from app.ui.export.pages import page_of
from app.ui.export.poster import SIZE, png, poster
from tests.export_clip import arm_of, nearer, run
from tests.ui_page import at, body


@pytest.fixture(scope="module")
def arm(robot: Robot) -> Arm:
    return arm_of(robot)


@pytest.fixture(scope="module")
def clip(arm: Arm) -> Exported:
    return exported(arm, run(arm))


@pytest.fixture(scope="module")
def page(arm: Arm, clip: Exported) -> str:
    return page_of(arm, [clip], "Recorded in a test.")


def facts_in(page: str) -> dict:
    found = FACTS.search(page)
    assert found is not None
    return json.loads(found[1])


def test_the_page_is_one_file_that_asks_nobody(page: str) -> None:
    assert "default-src 'none'" in page and "http-equiv" in page
    outer = re.sub(r'<script type="[^"]+" id="(viewer|scene-0)">.*?</script>', "", page, flags=re.S)
    assert not re.search(r"""(src|href)\s*=\s*["'](https?:)?//""", outer)
    assert "fetch(" not in outer and "XMLHttpRequest" not in outer
    assert len(page) < 4e6


def test_pictures_come_twenty_times_a_second_or_as_often_as_is_asked(arm: Arm) -> None:
    times = exported(arm, run(arm)).curves.times
    assert np.diff(times) == pytest.approx(0.06, abs=0.021) and len(times) >= 16
    times = exported(arm, run(arm), stride=10).curves.times
    assert times == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8])


def test_a_moment_of_danger_between_two_pictures_is_in_the_chart(arm: Arm) -> None:
    curves = exported(arm, run(arm, least_at=0.5), stride=10).curves
    assert curves.nearest.distance == pytest.approx(0.08)
    assert curves.nearest.time == pytest.approx(0.5)
    assert curves.table()["distance"] == pytest.approx([0.3, 0.3, 0.3, 0.08, 0.3])


def test_a_stop_is_marked_with_its_reason(page: str) -> None:
    marks = facts_in(page)["clips"][0]["marks"]
    assert [(m["kind"], m["time"]) for m in marks] == [("stop", pytest.approx(0.8))]
    assert marks[0]["words"] == "Stopped: lost <b>port</b>"


def test_what_the_controller_looks_at_is_drawn_only_where_it_differs(arm: Arm) -> None:
    alike, apart = Curves(arm.robot.links), Curves(arm.robot.links)
    for snapshot in run(arm, seconds=0.1):
        for curves, other in ((alike, snapshot), (apart, replace(snapshot, pairs=nearer(
            snapshot.pairs, 0.5)))):  # fmt: skip
            curves.tick(other)
            curves.picture(other)
    assert set(alike.table()["own"]) == {None}
    assert set(apart.table()["own"]) == {0.5}


def test_no_text_of_a_run_can_end_the_element_it_stands_in(clip: Exported) -> None:
    evil = "</script><script>alert(1)</script>"
    page = document([clip.clip], clip.entries, Words(evil, evil, evil, {"title": evil}))
    assert "alert(1)" in page and evil not in page
    assert facts_in(page)["title"] == evil


def test_only_what_was_there_is_in_the_legend(page: str) -> None:
    labels = [entry["label"] for entry in facts_in(page)["legend"]]
    assert {"Closest pair", "Kept points", "Sensors", "Known cell", "Bodies", "Goal"} <= set(labels)
    assert not {"Ghost", "Remembered points", "Separation", "Contacts"} & set(labels)
    hidden = {e["label"] for e in facts_in(page)["legend"] if not e["on"]}
    assert hidden == {"Self points"}


def test_the_eye_looks_past_what_stands_before_the_arm(arm: Arm) -> None:
    free = replace(next(iter(run(arm))), world=())
    eye = choose_eye(free)
    towards = (eye.position - eye.target) / np.linalg.norm(eye.position - eye.target)
    wall = body("Wall", half=0.7)
    walled = replace(free, world=(at(wall, list(eye.target + 1.0 * towards)),))
    points = free.T_base_link[:, :3, 3]
    assert visible(points, eye.position, walled) < 0.7
    assert visible(points, choose_eye(walled).position, walled) > 0.9


def test_a_poster_shows_the_arm_before_the_sky(arm: Arm, clip: Exported) -> None:
    file = poster(arm, clip.nearest, clip.eye)
    assert file.startswith(b"\x89PNG") and len(file) < 60_000
    assert struct.unpack(">II", file[16:24]) == SIZE
    rows = pixels(file)
    assert np.ptp(rows[0].astype(int), axis=0).max() < 30  # sky
    middle = rows[SIZE[1] // 2].astype(int)
    assert np.ptp(middle, axis=0).max() > 60  # something stands there


def pixels(file: bytes) -> np.ndarray:
    """Of a PNG as this program writes it."""
    begin = file.index(b"IDAT")
    (size,) = struct.unpack(">I", file[begin - 4 : begin])
    width, height = struct.unpack(">II", file[16:24])
    raw = np.frombuffer(zlib.decompress(file[begin + 4 : begin + 4 + size]), dtype=np.uint8)
    rows = raw.reshape(height, 1 + 3 * width)[:, 1:]
    return np.cumsum(rows, axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_a_picture_is_written_as_it_is() -> None:
    image = np.random.default_rng(0).integers(0, 256, (7, 5, 3), dtype=np.uint8)
    np.testing.assert_array_equal(pixels(png(image)), image)


def test_a_part_that_is_empty_or_too_long_is_refused(arm: Arm) -> None:
    with pytest.raises(ConfigError, match="no tick to show"):
        exported(arm, iter(()))
    slow = (replace(s, stamp=200.0 * s.stamp) for s in run(arm))
    with pytest.raises(ConfigError, match="--from and --to"):
        exported(arm, slow)
    with pytest.raises(ConfigError, match="first before the second"):
        Part(5.0, 2.0)
    with pytest.raises(ConfigError, match="stride"):
        Part(stride=-1)


def test_a_gallery_lists_the_exported_pages_and_no_other(tmp_path: Path, page: str) -> None:
    (tmp_path / "one clip.html").write_text(page, "utf-8")
    (tmp_path / "notes.html").write_text("<p>notes</p>")
    assert write_index(tmp_path) == 1
    index = (tmp_path / "index.html").read_text("utf-8")
    assert 'href="one%20clip.html"' in index and "notes" not in index
    assert "8 cm, " in index and "1.0 s" in index and "(QP)" in index
    assert "data:image/png;base64," in index and "<script" not in index
    assert write_index(tmp_path) == 1  # the index is no clip


def test_a_page_that_lies_about_itself_harms_no_gallery(tmp_path: Path) -> None:
    lie = {"title": "<img src=x onerror=alert(1)>", "least": ["<b>"], "controllers": ["<i>"],
           "picture": "https://elsewhere/x.png", "seconds": "<u>"}  # fmt: skip
    text = json.dumps({"index": lie}).replace("<", "\\u003c")
    (tmp_path / "lie.html").write_text(
        f'<script type="application/json" id="facts">{text}</script>'
    )
    write_index(tmp_path)
    index = (tmp_path / "index.html").read_text("utf-8")
    assert "<img src=x" not in index and "elsewhere" not in index and "<u>" not in index


def test_a_folder_without_clips_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="flinch export"):
        write_index(tmp_path)
    with pytest.raises(ConfigError, match="no such folder"):
        write_index(tmp_path / "nowhere")
