"""Cell files: what a person writes is read and never touched; what is learned goes to the end."""

import errno
import os

import numpy as np
import pytest

from app.assets import asset_folder
from app.cell.files import load_cell, save_learned
from app.cell.learned import NOTHING_LEARNED, Learned, grown, keys_of
from app.cell.parts import LEARNED, Cell
from app.control.beginning import warnings
from app.errors import ConfigError
from app.robot.model import find_robot, load_robot
from app.world.cells import find_cell, is_scene, read_cell

SHIPPED = sorted(p.stem for p in (asset_folder("static_assets") / "cells").glob("*.toml"))
MINE = b"""# drawn with a tape measure, \xc2\xb1 1 cm
title = "Mine"
[[box]]   # the press
name = "press"
position_m = [1, 0, 0.5]
rpy_deg = [0, 0, 90]
size_m = [0.4, 0.6, 1]

[[plane]]
name = "floor"
position_m = [0.0, 0.0, -0.8]"""
CUBES = Learned.of(np.array([[3, -2, 1], [0, 0, 0], [3, -2, 1]]))


def written(tmp_path, content=MINE):
    file = tmp_path / "mine.toml"
    file.write_bytes(content)
    return file


def test_a_cell_is_read(tmp_path):
    cell = load_cell(written(tmp_path))
    assert cell.title == "Mine" and cell
    assert cell.names == ("press", "floor", LEARNED)
    (box,), (plane,) = cell.boxes, cell.planes
    np.testing.assert_allclose(
        box.T_base_box[:3], [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0.5]], atol=1e-12
    )
    assert box.size.tolist() == [0.4, 0.6, 1.0]
    assert plane.T_base_plane[2, 3] == -0.8 and plane.size.tolist() == [2.0, 2.0]
    assert len(cell.learned) == 0 and not Cell()
    with pytest.raises(ValueError):
        box.size[0] = 1.0


def test_what_was_learned_survives_its_file_and_what_a_person_wrote_stays_byte_for_byte(tmp_path):
    file = written(tmp_path)
    for learned in (CUBES, NOTHING_LEARNED, Learned.of(np.arange(90).reshape(-1, 3))):
        save_learned(file, learned)
        assert file.read_bytes().startswith(MINE + b"\n[learned]")
        assert file.read_bytes().count(b"[learned]") == 1
        cell = load_cell(file)
        assert np.array_equal(cell.learned.cells, learned.cells)
        assert cell.names == ("press", "floor", LEARNED)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.toml"]


def test_the_same_cubes_make_the_same_file(tmp_path):
    one, two = tmp_path / "a.toml", tmp_path / "b.toml"
    save_learned(one, CUBES)
    save_learned(two, Learned.of(CUBES.cells[::-1].copy()))
    assert one.read_bytes() == two.read_bytes()
    assert np.array_equal(load_cell(one).learned.cells, [[0, 0, 0], [3, -2, 1]])


def test_a_link_and_the_rights_of_a_file_stay(tmp_path):
    file, link = written(tmp_path), tmp_path / "link.toml"
    link.symlink_to(file)
    file.chmod(0o640)
    save_learned(link, CUBES)
    assert link.is_symlink() and len(load_cell(file).learned) == 2
    assert file.stat().st_mode & 0o777 == 0o640


def test_a_full_disk_is_told_in_one_line_and_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    file = written(tmp_path)

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ConfigError, match=r"mine\.toml: cannot be written \(No space left") as told:
        save_learned(file, CUBES)
    assert "\n" not in str(told.value)
    assert file.read_bytes() == MINE and len(list(tmp_path.iterdir())) == 1


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(ConfigError, match="cannot be written"):
        save_learned(tmp_path / "nowhere" / "mine.toml", CUBES)


@pytest.mark.parametrize(
    "content",
    [
        b'[learned]\nedge_m = 0.05\ncells = []\n[[box]]\nname = "b"',
        b"learned.cells = []",
        b"learned = { cells = [] }\n",
    ],
)
def test_a_file_that_would_lose_something_is_not_written_to(tmp_path, content):
    file = written(tmp_path, content)
    with pytest.raises(ConfigError, match=r"\[learned\] is not the last table; move it"):
        save_learned(file, CUBES)
    assert file.read_bytes() == content


BOX = '[[box]]\nname = "b"\nposition_m = [0, 0, 0]\nsize_m = [1, 1, 1]\n'


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("title = ", ["not valid TOML"]),
        ("[[bxo]]", ["bxo"]),
        ("[[box]]\nsize_m = [1, 1, 1]", ["box 1", "'name' is missing"]),
        (BOX.replace('"b"', '""'), ["name = ''", "a text"]),
        (BOX.replace("[1, 1, 1]", "[1, 1]"), ["box 'b'", "size_m = [1, 1]; give 3 finite numbers"]),
        (BOX.replace("[1, 1, 1]", "[1, 1, 0]"), ["size_m = [1, 1, 0]; give numbers above zero"]),
        (BOX.replace("[0, 0, 0]", "[0, 0, nan]"), ["box 'b'", "position_m", "3 finite numbers"]),
        (BOX.replace("[0, 0, 0]", '["0", 0, 0]'), ["position_m"]),
        (BOX + BOX, ["'b' comes twice"]),
        (BOX + '[[plane]]\nname = "b"\nposition_m = [0, 0, 0]', ["'b' comes twice"]),
        (BOX.replace('"b"', f'"{LEARNED}"'), ["comes twice"]),
        ("[learned]\nedge_m = 0.1\ncells = []", ["edge_m = 0.1", "learn anew"]),
        ("[learned]\nedge_m = 0.05\ncells = [[1, 2]]", ["cells[0] = [1, 2]", "3 whole numbers"]),
        (
            "[learned]\nedge_m = 0.05\ncells = [[1, 2, 3.5]]",
            ["cells[0]", "3 whole numbers"],
        ),
        (
            "[learned]\nedge_m = 0.05\ncells = [[1, 2, 999999999]]",
            ["cells[0]", "from -2000 up to 2000"],
        ),
    ],
)
def test_a_bad_cell_is_told_in_one_line(tmp_path, content, told):
    file = tmp_path / "bad.toml"
    file.write_text(content)
    with pytest.raises(ConfigError) as error:
        load_cell(file)
    message = str(error.value)
    assert "\n" not in message and "bad.toml" in message
    for part in told:
        assert part in message


def test_neighbours_of_cubes_are_all_that_touch_them():
    around = grown(keys_of(np.array([[0, 0, 0], [0, 0, 1], [-9, 5, 2]])))
    assert len(around) == 3 * 3 * 4 + 27
    assert np.array_equal(around, np.unique(around))


# --- by name ------------------------------------------------------------------------------


def test_a_cell_is_found_by_name_by_path_and_as_that_of_a_scene(tmp_path):
    assert {"table", "bench"} <= set(SHIPPED)
    assert read_cell(find_cell("table")).names[0] == "table"
    scene = find_cell("cell")
    assert is_scene(scene) and "door panel" in read_cell(scene).names
    mine = written(tmp_path)
    assert find_cell(str(mine)) == mine and not is_scene(mine)
    assert read_cell(mine).title == "Mine"
    own_scene = tmp_path / "scene.toml"
    own_scene.write_text('title = "t"\n[[crop]]\nname = "c"\nsize_m = [1, 1, 1]\n')
    assert read_cell(own_scene).names == ("c", LEARNED)


def test_an_unknown_cell_lists_the_known(tmp_path):
    with pytest.raises(
        ConfigError, match=r"'tabel'.*did you mean 'table'\? known: .*cell, .*empty"
    ):
        find_cell("tabel")
    with pytest.raises(ConfigError, match="no file"):
        find_cell(str(tmp_path / "none.toml"))


@pytest.mark.parametrize("name", SHIPPED)
def test_no_robot_begins_near_a_shipped_cell(name):
    cell = read_cell(find_cell(name))
    assert cell.title and cell.planes
    for robot in ("ur10e", "swan7"):
        assert warnings(load_robot(find_robot(robot)), cell) == ()
