"""The house's conventions that no linter knows."""

import json
import re
import shutil
import subprocess
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from app.cli import COMMANDS, main
from app.config import tunables
from app.control.registry import forget, kinds

ROOT = Path(__file__).parent.parent
# The machine that a file was written on, and the place that its packages came from.
PRIVATE_PATH = re.compile(r"(?<![\w.])/(home|root|Users|work|opt)/\w")
REGISTRY = re.compile(r"\b(py(pi|thon[h]osted)|npmjs|(ana)?conda)\.(org|com|io)\b")


def flags_of(command) -> set[str]:
    """Of a command and of all of its sub-commands."""
    kinds = get_type_hints(command)
    inner = [c for kind in kinds.values() for c in get_args(kind) if is_dataclass(c)]
    own = {f.name.replace("_", "-") for f in fields(command)}
    return own.union(*map(flags_of, inner))


def tracked_texts() -> list[tuple[str, str]]:
    """Name and text of every file that git keeps or would keep; binary files left out."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git checkout")
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    texts = []
    for name in filter(None, names.split("\0")):
        path = ROOT / name
        content = path.read_bytes() if path.is_file() else b"\0"
        if b"\0" not in content:
            texts.append((name, content.decode(errors="replace")))
    return texts


def test_no_file_of_the_product_is_longer_than_400_lines() -> None:
    lengths = {p: len(p.read_text().splitlines()) for p in (ROOT / "app").rglob("*.py")}
    assert lengths
    assert {str(p.relative_to(ROOT)): n for p, n in lengths.items() if n > 400} == {}


def test_every_setting_tells_its_help_and_its_range() -> None:
    assert kinds()
    for t in tunables():
        assert t.help, t.name
        if t.kind is bool or t.choices:
            continue
        assert t.low is not None and t.high is not None, t.name
        assert t.low <= t.default <= t.high, t.name


def test_every_setting_without_a_unit_is_a_pure_number() -> None:
    """A share, a weight, a count of sigmas: whatever else is a number needs its unit."""
    pure = {"joint_speed"}
    bare = {t.name for t in tunables() if not t.unit and t.kind is not bool and not t.choices}
    assert bare == pure


def test_the_constraints_are_exact_versions_and_nothing_else() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    assert [x for x in lines if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+", x)] == []
    assert lines == sorted(lines, key=str.upper)


def test_every_requirement_is_constrained() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    wanted = sum(extras, project["dependencies"])
    names = {re.split(r"[^\w-]", x)[0].lower() for x in wanted}
    pinned = {x.split("==")[0].lower() for x in (ROOT / "constraints.txt").read_text().split()}
    assert names - pinned == set()


def test_no_tracked_text_names_this_machine_or_a_package_registry() -> None:
    texts = tracked_texts()
    assert "pyproject.toml" in {name for name, _ in texts}
    found = [
        f"{name}:{number}: {line.strip()[:80]}"
        for name, text in texts
        for number, line in enumerate(text.splitlines(), 1)
        if PRIVATE_PATH.search(line) or REGISTRY.search(line)
    ]
    assert found == []


MANUAL = sorted((ROOT / "static_assets/manual").glob("*.md"))
BOOK = [ROOT / "README.md", *MANUAL]


def examples(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.S)


def test_the_example_in_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = examples(ROOT / "README.md")
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("running ")


def test_the_controller_in_the_manual_drives_the_arm_and_acts_in_twenty_lines(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (mine,) = examples(ROOT / "static_assets/manual/experiments.md")
    assert len(mine.split("def act")[1].splitlines()) <= 20
    (tmp_path / "mine.py").write_text(mine)
    flags = ["--headless", "--seconds", "0.4", "--scene", "approach", "--json"]
    mode = str(tmp_path / "mine.py")
    try:
        assert main(["run", "--controller", mode, *flags]) == 0
        row = json.loads(capsys.readouterr().out)["rows"][0]
        assert row["mode"] == mode and row["status"] == "running"
    finally:
        forget(mode)


@pytest.mark.parametrize("page", BOOK, ids=lambda p: p.stem)
def test_every_flag_in_the_manual_exists(page: Path) -> None:
    used = set(re.findall(r"^\.venv/bin/flinch .*?(?=\s{2,}#|$)", page.read_text("utf-8"), re.M))
    flags = {flag for line in used for flag in re.findall(r"--([a-z-]+)", line)}
    known = {flag for command in COMMANDS.values() for flag in flags_of(command)} | {
        t.name.replace("_", "-") for t in tunables()
    }
    assert flags <= known


@pytest.mark.parametrize("page", BOOK, ids=lambda p: p.stem)
def test_every_link_of_the_manual_leads_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)", page.read_text("utf-8"))
    near = [link for link in links if "://" not in link]
    assert [link for link in near if not (page.parent / link).exists()] == []


def test_the_readme_is_short_and_leads_to_every_page_of_the_manual() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    assert len(text.splitlines()) <= 150
    assert [page.name for page in MANUAL if f"manual/{page.name}" not in text] == []
