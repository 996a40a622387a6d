"""Recordings become pages by their command, and a folder of them a gallery."""

import json
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.record.reader import open_recording
from app.studies.paper_scenes import MODES, SCENES, record_scene
from app.ui.export.export import Part
from app.ui.export.gallery import FACTS
from app.ui.export.recorded import run_of


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three tenths of a second before the plate, with each controller."""
    folder = tmp_path_factory.mktemp("recorded")
    return list(record_scene(SCENES[0], folder, share=0.3 / SCENES[0].seconds))


def facts(path: Path) -> dict:
    found = FACTS.search(path.read_text("utf-8"))
    assert found is not None
    return json.loads(found[1])


def test_a_part_of_a_recording_is_exported_with_a_ghost(
    recorded: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.html"
    flags = ["--from", "0.1", "--to", "0.25", "--stride", "5", "--ghost", "sm"]
    assert main(["export", str(recorded[-1]), str(out), *flags]) == 0
    assert "MB, opens in any browser" in capsys.readouterr().out
    told = facts(out)
    assert told["index"]["seconds"] == pytest.approx(0.16, abs=0.02)
    assert np.diff(told["clips"][0]["times"]) == pytest.approx(0.02)
    assert "(SM)" in told["about"] and "Ghost" in {e["label"] for e in told["legend"]}
    assert "honest world, seed 0" in told["foot"]


def test_a_ghost_stands_where_its_command_would_bring_the_arm(recorded: list[Path]) -> None:
    with open_recording(recorded[-1]) as recording:
        _, run = run_of(recording, Part(begin=0.2), {"mode": "sm"})
        snapshot = list(run)[-1]
        assert snapshot.ghost is not None
        moved = np.abs(snapshot.ghost.T_base_link[-1, :3, 3] - snapshot.T_base_link[-1, :3, 3])
        assert moved.max() > 1e-4
        assert snapshot.tick == recording.inputs(len(recording) - 1).tick


def test_controllers_stand_side_by_side_and_in_an_index(
    recorded: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "all.html"
    assert main(["export", *map(str, recorded), str(out)]) == 0
    told = facts(out)
    assert len(told["clips"]) == len(MODES) and "Side by side" in told["about"]
    assert main(["gallery", str(tmp_path)]) == 0
    assert "1 page" in capsys.readouterr().out
    assert "(WB)" in (tmp_path / "index.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["RUN"], "OUT.html"),
        (["RUN", "out.txt"], "OUT.html"),
        (["RUN", "nowhere/out.html"], "make it first"),
        (["RUN", "out.html", "--ghost", "nobody"], "choose one of"),
        (["RUN", "out.html", "--from", "5", "--to", "6"], "no tick to show"),
        (["missing.mcap", "out.html"], "missing.mcap"),
    ],
)
def test_what_cannot_be_exported_is_said_in_one_line(
    recorded: list[Path], tmp_path: Path, args: list[str], words: str,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["export", *[str(recorded[0]) if a == "RUN" else a for a in args]]) == 1
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert not (tmp_path / "out.html").exists()
