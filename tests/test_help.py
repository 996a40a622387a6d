"""Help comes at once: no command's `--help` waits for compilers, meshes or the page."""

import json
import subprocess
import sys

import pytest

from app.cli import COMMANDS

HEAVY = {
    "app.compiled", "app.wiring", "coal", "embreex", "matplotlib", "numba", "numpy", "pinocchio",
    "proxsuite", "scipy", "trimesh", "viser", "websockets", "yourdfpy",
}  # fmt: skip
ASK = """
import json, sys
from app.cli import main
try:
    main(sys.argv[1:])
finally:
    print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


@pytest.mark.parametrize(
    "words", [(), *((name,) for name in COMMANDS), ("skin", "check"), ("skin", "emulate")]
)
def test_help_loads_nothing_heavy(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-c", ASK, *words, "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(" ".join(("usage: flinch", *words)))
    assert HEAVY & set(json.loads(done.stderr)) == set()
