"""Pictures of a study's figures."""

import builtins

import pytest

from app.errors import StudyError
from app.studies.plots import draw_lines

PANELS = {"by size": {"ours": ([1.0, 10.0], [0.1, 0.2])}}


def test_lines_are_drawn_with_their_names(tmp_path):
    file = tmp_path / "growth.svg"
    draw_lines(file, PANELS, "faces", "ms", log=True)
    assert b"<svg" in file.read_bytes()


def test_a_place_that_cannot_be_drawn_to_is_named(tmp_path):
    with pytest.raises(StudyError, match=r"growth\.xyz"):
        draw_lines(tmp_path / "growth.xyz", PANELS, "faces", "ms")
    with pytest.raises(StudyError, match="no_such_folder"):
        draw_lines(tmp_path / "no_such_folder" / "growth.svg", PANELS, "faces", "ms")


def test_without_matplotlib_the_remedy_is_told(tmp_path, monkeypatch):
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(StudyError, match=r"flinch\[plots\]"):
        draw_lines(tmp_path / "growth.svg", PANELS, "faces", "ms")
