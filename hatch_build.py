"""How the installed package comes by its name: `app` in the checkout, `flinch` in the wheel.

`app` is a name that anybody may have, so it must neither lie in a user's site-packages nor stand
in `sys.modules` of his program. The ways there are:

* `app` inside a package `flinch`, found by a path that is added when it is imported: its modules
  would still be called `app` in everybody's program.
* Relative imports everywhere, so that the folder's name does not matter: what a module leans on
  could no longer be read from its first lines, nor be searched for.
* `flinch` in the checkout as well: clean, and a rename of every file.
* One rule, applied to the copy that goes into the wheel: the first word of a dotted name of one of
  our own modules. It is this one. No line moves, so a trace still tells the line of the checkout.

A checkout and an editable install keep `app`; there `flinch.py` lends it the other name.
"""

import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCE, NAME = "app", "flinch"
BESIDE = ("robots", "static_assets")  # what lies beside the package in a checkout


class OwnName(BuildHookInterface):  # type: ignore[type-arg]
    """Puts a renamed copy of the package, and what lies beside it, into a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make the copy; an editable wheel only points at the checkout."""
        if version != "standard":
            return
        root, self._copy = Path(self.root), Path(tempfile.mkdtemp())
        shutil.copytree(root / SOURCE, self._copy / NAME, ignore=ignored)
        for folder in BESIDE:
            shutil.copytree(root / folder, self._copy / NAME / "_data" / folder, ignore=ignored)
        rule = own_names(root / SOURCE)
        for file in self._copy.rglob("*.py"):
            file.write_text(rule.sub(NAME, file.read_text("utf-8")), "utf-8")
        build_data["force_include"][str(self._copy / NAME)] = NAME

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """The copy has gone into the wheel."""
        if version == "standard":
            shutil.rmtree(self._copy)


def ignored(folder: str, names: list[str]) -> set[str]:
    """What is made anew on every machine."""
    return {n for n in names if n == "__pycache__" or n.endswith((".pyc", ".nbi", ".nbc"))}


def own_names(package: Path) -> "re.Pattern[str]":
    """The package's name where one of its modules follows, or where one is imported from it."""
    modules = {p.stem for p in package.iterdir() if p.suffix == ".py" or p.is_dir()}
    known = "|".join(sorted(modules - {"__init__", "__pycache__"}))
    return re.compile(rf"(?<![\w./]){SOURCE}(?=\.(?:{known})\b)|(?<=\bfrom ){SOURCE}(?= import\b)")
