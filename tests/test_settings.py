"""The list of settings as a file to edit and as the manual's table."""

import re
import tomllib
from pathlib import Path

from app.cli import main
from app.config import Params, load_params, tunables
from app.control.registry import kinds

REFERENCE = Path(__file__).parent.parent / "static_assets/manual/reference.md"


def said(capsys, *args):
    assert main(["settings", *args]) == 0
    return capsys.readouterr().out


def test_the_list_of_settings_is_a_file_that_changes_nothing(capsys, tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text(said(capsys))
    assert load_params(file) == Params()
    assert set(tomllib.loads(file.read_text())) == {t.name for t in tunables()}


def test_a_choice_is_listed_with_all_its_names(capsys):
    (line,) = re.findall(r"^mode = .*", said(capsys), re.M)
    assert all(f"{name} = " in line for name in ("qp", "wb", "sm", "multi", "ssm", "paper"))


def test_the_table_in_the_manual_is_the_one_that_the_command_prints(capsys):
    assert said(capsys, "--markdown") in REFERENCE.read_text("utf-8")


def test_the_manual_names_every_controller():
    rows = re.findall(r"^\| `(\w+)`.* \|", REFERENCE.read_text("utf-8"), re.M)
    assert kinds().keys() <= set(rows)
