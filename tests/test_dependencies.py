"""Every package earns its place: declared with a reason and imported; no other is imported."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "pyproject.toml").read_text()
PROJECT = tomllib.loads(TEXT)["project"]
MODULES = {  # of a package, where they are not called as it is
    "foxglove-schemas-protobuf": {"foxglove_schemas_protobuf"},
    "libigl": {"igl"},
    "mcap-protobuf-support": {"mcap_protobuf"},
    "pin": {"pinocchio", "coal"},
    "pin-pink": {"pink"},
    "pyserial": {"serial"},
    "pyyaml": {"yaml"},
    "ur-rtde": {"rtde_control"},
}
EXTRAS = [r for extra in PROJECT["optional-dependencies"].values() for r in extra]
APART = {"open3d"}  # has an environment of its own: app/bench/elsewhere


def packages(requirements: list[str]) -> set[str]:
    """The names of packages without their versions."""
    return {re.split(r"[^\w-]", r)[0] for r in requirements}


def modules(requirements: list[str]) -> set[str]:
    """What may be imported of packages."""
    return set().union(*(MODULES.get(p, {p}) for p in packages(requirements)))


def imported(path: Path) -> Iterator[str]:
    """Top packages that a file imports, by statement or by name."""
    for node in ast.walk(ast.parse(path.read_text())):
        names: list[str] = []
        match node:
            case ast.Import():
                names = [a.name for a in node.names]
            case ast.ImportFrom(module=str(name), level=0):
                names = [name]
            case ast.Call(func=ast.Name(id="import_module"), args=[ast.Constant(value=str(name))]):
                names = [name]
        yield from (name.split(".")[0] for name in names)


def guests() -> dict[str, set[str]]:
    """Files of the product by the third-party package that they import."""
    found: dict[str, set[str]] = {}
    for path in (ROOT / "app").rglob("*.py"):
        for name in set(imported(path)) - set(sys.stdlib_module_names) - {"app"}:
            found.setdefault(name, set()).add(str(path.relative_to(ROOT)))
    return found


@pytest.mark.parametrize("package", sorted(packages(PROJECT["dependencies"])))
def test_every_dependency_is_imported(package: str) -> None:
    assert MODULES.get(package, {package}) & guests().keys()


def test_every_guest_is_declared() -> None:

    declared = modules(PROJECT["dependencies"] + EXTRAS) | APART
    assert {name: files for name, files in guests().items() if name not in declared} == {}


def test_every_requirement_has_its_reason_beside_it() -> None:
    requirement = re.compile(r'^ +"[A-Za-z][\w.-]*(\[\w+\])?(==|>=)[^"]*",(?P<reason>.*)$', re.M)
    lines = [m for m in requirement.finditer(TEXT)]
    assert len(lines) > 20
    assert [m[0].strip() for m in lines if not re.fullmatch(r" # \S.*", m["reason"])] == []
