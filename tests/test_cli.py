"""The front door: bad input is one line and a non-zero exit, JSON is JSON and nothing else."""

import json
import socket
import subprocess
import sys

import pytest

from app.cli import main


def flinch(*args):
    return subprocess.run(
        [sys.executable, "-m", "app", *args], capture_output=True, text=True, timeout=120
    )


def refused(capsys, *args):
    code = main(args)
    out, err = capsys.readouterr()
    assert code == 1 and out == ""
    assert err.startswith("flinch: ") and err.count("\n") == 1
    return err


def test_an_unknown_robot_is_one_line(capsys):
    assert "known: " in refused(capsys, "run", "--robot", "ur99")


def test_an_unknown_scene_is_one_line(capsys):
    assert "cell" in refused(capsys, "run", "--scene", "moon", "--headless")


def test_an_unknown_skin_is_one_line(capsys):
    assert "forearm-rings" in refused(capsys, "run", "--skin", "scales", "--headless")


def test_broken_toml_is_one_line(capsys, tmp_path):
    file = tmp_path / "s.toml"
    file.write_text("title = [")
    assert "not valid TOML" in refused(capsys, "run", "--scene", str(file), "--headless")
    assert "not valid TOML" in refused(capsys, "run", "--config", str(file), "--headless")
    file.write_text("distance_kpet = 0.2")
    assert "distance_kept" in refused(capsys, "run", "--config", str(file), "--headless")


def test_a_flag_of_before_says_what_it_is_called_now(capsys):
    assert "distance_kept" in refused(capsys, "run", "--d-s", "0.3", "--headless")
    assert "joint_speed" in refused(capsys, "run", "--speed=0.3", "--headless")


def test_an_unreadable_replay_is_one_line(capsys):
    assert "cannot be read" in refused(capsys, "run", "--sensors", "replay:/none", "--headless")
    assert "replay:PATH" in refused(capsys, "run", "--sensors", "camera", "--headless")


def test_a_value_out_of_range_is_one_line(capsys):
    assert "0.05 to 0.4" in refused(capsys, "run", "--headless", "--distance-kept", "7")
    assert "50 to 500" in refused(capsys, "run", "--headless", "--rate", "9000")
    assert "--headless" in refused(capsys, "run", "--json")


def test_a_taken_port_is_one_line_and_nothing_is_left_running():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = flinch("run", "--port", str(port), "--no-open")
    assert result.returncode == 1 and result.stdout == ""
    assert str(port) in result.stderr and result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("flags", [["--host", "0.0.0.0"], ["--origin", "https://cell.example"]])
def test_a_page_for_others_without_a_token_is_one_line(flags, capfd, monkeypatch):
    monkeypatch.delenv("FLINCH_TOKEN", raising=False)
    assert main(["run", *flags, "--no-open"]) == 1
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and "--token-file" in err and flags[1] in err


def test_a_missing_mesh_is_one_line(tmp_path, capfd):
    import shutil

    from app.robot.model import find_robot

    folder = tmp_path / "arm"
    shutil.copytree(find_robot("ur10e"), folder)
    (folder / "meshes/body/forearm_link.stl").unlink()
    assert main(["run", "--robot", str(folder), "--headless"]) == 1
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and "forearm_link.stl" in err


def test_headless_json_is_one_object_in_the_common_form():
    result = flinch("run", "--headless", "--seconds", "0.5", "--seed", "3", "--world", "ideal",
                    "--json")  # fmt: skip
    assert result.returncode == 0, result.stderr
    content = json.loads(result.stdout)
    assert list(content) == ["what", "machine", "versions", "seed", "rows", "checks"]
    assert content["what"] == "run" and content["seed"] == 3
    row = content["rows"][0]
    assert row["lowest_point_m"] > 0.0 and row["blind_share"] == 0.0
    assert 0.0 <= row["avoiding_share"] <= 1.0
    assert sum(row["reasons"].values()) == row["ticks"] and row["advice"] == {}
    assert all({"name", "value", "unit", "limit", "ok"} == set(c) for c in content["checks"])


def test_flags_win_over_the_file(tmp_path, capsys):
    file = tmp_path / "c.toml"
    file.write_text('mode = "sm"\ndistance_kept = 0.3\n')
    common = ("run", "--headless", "--seconds", "0.1", "--scene", "empty", "--json")
    assert main([*common, "--config", str(file), "--mode", "wb"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["mode"] == "wb"


def test_a_replay_ends_with_a_named_stop(tmp_path, capsys):
    lines = []
    for f in range(20):
        lines += [f"{1000 + 67 * f},0,0"] + ["400,1,5"] * 64
    (tmp_path / "state_ToF.csv").write_text("\n".join(lines))
    code = main(["run", "--headless", "--sensors", f"replay:{tmp_path}@ring2-03", "--json"])
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert code == 0 and row["status"] == "stopped"
    assert "has ended" in row["stops"][0]["reason"]
    assert 0.2 < row["min_perceived_distance_m"] < 0.5


@pytest.mark.slow
def test_bench_tick_reports_every_room_and_checks():
    result = flinch("bench", "tick", "--seconds", "1", "--json")
    content = json.loads(result.stdout)
    names = {r["name"] for r in content["rows"]}
    assert {"filter", "pairs", "control", "tick", "lateness", "lateness, empty loop"} <= names
    assert len(content["checks"]) == 2
