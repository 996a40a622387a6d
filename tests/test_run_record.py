"""`flinch run --record`: headless and beside the page, ended well and badly."""

import json
import signal
import subprocess
import sys

from app.cli import main
from app.record.reader import open_recording

HEADLESS = ("run", "--headless", "--seconds", "0.2", "--rate", "125")


def test_a_headless_run_is_recorded_and_said(tmp_path, capsys):
    path = tmp_path / "run.mcap"
    assert main([*HEADLESS, "--record", str(path)]) == 0
    out, err = capsys.readouterr()
    with open_recording(path) as recording:
        ticks = len(recording)
        assert recording.torn == "" and recording.dropped == 0 and 25 <= ticks <= 27
        assert recording.head.setup.rate == 125.0 and recording.head.source == "simulated"
    assert out.splitlines()[-1] == f"recorded 0.2 s, {ticks} ticks, in {path}" and err == ""


def test_the_json_of_a_recorded_run_is_nothing_but_json(tmp_path, capsys):
    assert main([*HEADLESS, "--json", "--record", str(tmp_path / "run.mcap")]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["rows"] and err.startswith("recorded ")


def test_a_file_that_exists_is_left_alone(tmp_path, capsys):
    path = tmp_path / "run.mcap"
    path.write_text("mine")
    assert main([*HEADLESS, "--record", str(path)]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err == f"flinch: {path}: exists already; give another name\n"
    assert path.read_text() == "mine"


def test_a_recording_that_ends_before_its_run_is_an_error_after_the_report(
    tmp_path, capsys, monkeypatch
):
    def full(self):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.record.run_file.RunFile.flush", full)
    assert main([*HEADLESS, "--record", str(tmp_path / "run.mcap")]) == 1
    out, err = capsys.readouterr()
    assert out.startswith("run") and "recorded" not in out
    assert err.count("\n") == 1 and "has ended: No space left on device; 0.0 s of the run" in err


def test_a_run_with_its_page_is_recorded_until_it_is_asked_to_end(tmp_path):
    path = tmp_path / "run.mcap"
    command = ("run", "--port", "0", "--no-open", "--record", str(path), "--scene", "empty")
    child = subprocess.Popen(
        [sys.executable, "-m", "app", *command], stdout=subprocess.PIPE, text=True
    )
    try:
        assert any("Flinch is at" in line for line in child.stdout)
        child.send_signal(signal.SIGTERM)
        rest, _ = child.communicate(timeout=60)
    finally:
        child.kill()
        child.wait()
    with open_recording(path) as recording:
        assert recording.torn == "" and len(recording) > 0
        assert [recording.inputs(i).tick for i in range(len(recording))] == [*range(len(recording))]
        assert f"{len(recording)} ticks, in {path}" in rest
