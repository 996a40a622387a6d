"""Three TOML files and no Python: a cell of one's own, a layout with covers on the upper arm, and
what stands beside it."""

import json

import pytest

from app.cli import main
from app.messages import SensorHealth, Verdict
from app.robot.blind import blind_words
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine
from tests.own_place import write_place


@pytest.fixture
def place(tmp_path, monkeypatch):
    """The files' paths, and a cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return write_place(tmp_path)


def test_the_sensors_on_the_upper_arm_see_past_their_covers_and_the_arm_gives_way(place):
    setup = Setup(skin=place["skin"], cell=place["cell"], scene=place["scene"], world="ideal")
    engine = build_engine(setup, ManualClock())
    assert blind_words(engine.robot, engine.skin) == () == engine.warnings
    arm, cover = (engine.robot.link_index(f"upper_arm_{x}") for x in ("link", "cover"))
    near = []
    for _ in range(750):
        snapshot = engine.step()
        near.append(snapshot.body.distance[[arm, cover]].min())
    assert (snapshot.health == SensorHealth.GOOD).all()
    assert (snapshot.cloud.verdict == Verdict.KEPT).sum() > 200  # the post
    assert (snapshot.cloud.verdict == Verdict.STATIC).sum() > 50  # the bench is no obstacle
    assert min(near) < 0.11 and near[-1] > 0.14
    assert [b.name for b in engine.cell.boxes] == ["bench"]


def test_the_command_line_runs_them(place, capsys):
    files = [part for key in place for part in (f"--{key}", place[key])]
    assert main(["run", *files, "--headless", "--seconds", "1", "--json"]) == 0
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert row["warnings"] == [] and row["stops"] == [] and row["avoiding_share"] > 0.5
