"""The wheel: nothing is left behind, and it runs where there is no checkout."""

import json
import os
import subprocess
import sys
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

import app
from hatch_build import own_names

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout, built by the tools of this environment, without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, cwd=ROOT)
    (built,) = folder.glob("*.whl")
    return built


def run(*command: str | Path, cwd: Path) -> str:
    """Standard output of a command that must succeed; its own words are the failure's."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def test_the_wheel_carries_every_module_every_robot_and_every_scene(wheel: Path) -> None:
    inside = set(ZipFile(wheel).namelist())
    modules = {f"flinch/{p.relative_to(ROOT / 'app')}" for p in (ROOT / "app").rglob("*.py")}
    assert modules - inside == set()
    for folder in ("robots", "static_assets"):
        files = [p for p in (ROOT / folder).rglob("*") if p.is_file() and p.suffix != ".pyc"]
        carried = {f"flinch/_data/{p.relative_to(ROOT)}" for p in files}
        assert carried - inside == set()


@pytest.mark.parametrize(
    "pattern",
    [
        "robots/ur10e/robot.toml",
        "robots/ur10e/ur10e.urdf",
        "robots/ur10e/meshes/body/*.stl",
        "robots/ur10e/meshes/visual/*.glb",
        "robots/ur10e/skin/*.toml",
        "static_assets/scenes/cell.toml",
    ],
)
def test_the_wheel_carries_what_a_run_reads(wheel: Path, pattern: str) -> None:
    inside = [Path(name) for name in ZipFile(wheel).namelist()]
    assert any(name.match(f"flinch/_data/{pattern}") for name in inside)


def test_the_wheel_carries_nothing_but_the_product(wheel: Path) -> None:
    top = {name.split("/")[0] for name in ZipFile(wheel).namelist()}
    assert top == {"flinch", f"flinch-{app.__version__}.dist-info"}


def test_the_unpacked_wheel_finds_its_own_folders(wheel: Path, tmp_path: Path) -> None:
    ZipFile(wheel).extractall(tmp_path)
    names = ("robots", "static_assets")
    ask = f"from flinch.assets import asset_folder as f; print(*map(f, {names}), sep='\\n')"
    told = run(sys.executable, "-c", ask, cwd=tmp_path).splitlines()
    data = tmp_path / "flinch" / "_data"
    assert told == [str(data / name) for name in names]


def test_the_unpacked_wheel_is_flinch_all_the_way_down(wheel: Path, tmp_path: Path) -> None:
    """The checkout is on the path of this environment, so what leaned on it would find it."""
    ZipFile(wheel).extractall(tmp_path)
    ask = (
        "import sys, flinch, flinch.cli, flinch.wiring, flinch.ui.page, flinch.studies.pool;"
        "assert all(hasattr(flinch, name) for name in flinch.__all__);"
        "print(*{m.split('.')[0] for m in sys.modules} & {'app', 'flinch'}, flinch.__file__)"
    )
    told = run(sys.executable, "-c", ask, cwd=tmp_path).split()
    assert told == ["flinch", str(tmp_path / "flinch" / "__init__.py")]


def test_no_name_of_the_checkout_is_left_in_the_wheel(wheel: Path) -> None:
    rule = own_names(ROOT / "app")
    with ZipFile(wheel) as file:
        for name in (n for n in file.namelist() if n.endswith(".py")):
            text = file.read(name).decode()
            assert not rule.search(text), name
            compile(text, name, "exec")


def test_a_rule_that_renames_leaves_other_names_alone(tmp_path: Path) -> None:
    rule = own_names(ROOT / "app")
    for text in ("https://app.foxglove.dev", "my.app.control", "app.command(name)", "app = 1"):
        assert rule.sub("flinch", text) == text
    for text in ("from app import actions", "`app.control.qp`", '"app.ui.onlooker"'):
        assert rule.sub("flinch", text) == text.replace("app", "flinch", 1)


def test_an_editable_wheel_points_at_the_checkout_and_renames_nothing(tmp_path: Path) -> None:
    make = f"from hatchling.build import build_editable as b; b({str(tmp_path)!r})"
    run(sys.executable, "-c", make, cwd=ROOT)
    (built,) = tmp_path.glob("*.whl")
    with ZipFile(built) as file:
        top = [n for n in file.namelist() if "dist-info" not in n]
        assert [n.endswith(".pth") for n in top] == [True]
        assert file.read(top[0]).decode().strip() == str(ROOT)


@pytest.mark.slow
def test_the_wheel_runs_in_an_empty_environment_away_from_the_checkout(
    wheel: Path, tmp_path: Path
) -> None:
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    pip: list[str | Path] = [
        python,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]
    run(*pip, "-c", ROOT / "constraints.txt", wheel, cwd=tmp_path)
    flinch = tmp_path / "venv" / "bin" / "flinch"
    told = json.loads(run(flinch, "run", "--headless", "--seconds", "1", "--json", cwd=tmp_path))
    assert told["what"] == "run"
    assert told["checks"]
