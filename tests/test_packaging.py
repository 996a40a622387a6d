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
    modules = {str(p.relative_to(ROOT)) for p in (ROOT / "app").rglob("*.py")}
    assert modules - inside == set()
    for folder in ("robots", "static_assets"):
        files = [p for p in (ROOT / folder).rglob("*") if p.is_file() and p.suffix != ".pyc"]
        carried = {f"app/_data/{p.relative_to(ROOT)}" for p in files}
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
    assert any(name.match(f"app/_data/{pattern}") for name in inside)


def test_the_wheel_carries_nothing_but_the_product(wheel: Path) -> None:
    top = {name.split("/")[0] for name in ZipFile(wheel).namelist()}
    assert top == {"app", f"flinch-{app.__version__}.dist-info"}


def test_the_unpacked_wheel_finds_its_own_folders(wheel: Path, tmp_path: Path) -> None:
    ZipFile(wheel).extractall(tmp_path)
    names = ("robots", "static_assets")
    ask = f"from app.assets import asset_folder as f; print(*map(f, {names}), sep='\\n')"
    told = run(sys.executable, "-c", ask, cwd=tmp_path).splitlines()
    data = tmp_path / "app" / "_data"
    assert told == [str(data / name) for name in names]


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
