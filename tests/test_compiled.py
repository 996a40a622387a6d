"""Kernels that are kept on disk must never outlive what they are made of."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
HELPER = "from app.compiled import compiled\n\n\n@compiled\ndef helper() -> int:\n    return {}\n"
CALLER = (
    "from app.compiled import compiled\nfrom room.helper import helper\n\n\n"
    "@compiled\ndef caller() -> int:\n    return helper()\n"
)


def answer(folder: Path) -> str:
    code = "from room.caller import caller; print(caller())"
    env = dict(os.environ, PYTHONPATH=f"{folder}{os.pathsep}{ROOT}")
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=env,
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()


def test_an_edited_kernel_reaches_the_kernels_that_call_it(tmp_path: Path) -> None:
    room = tmp_path / "room"
    room.mkdir()
    (room / "__init__.py").write_text("")
    (room / "helper.py").write_text(HELPER.format(1))
    (room / "caller.py").write_text(CALLER)
    assert answer(tmp_path) == "1"
    assert answer(tmp_path) == "1"  # from what was kept
    (room / "helper.py").write_text(HELPER.format(22))
    assert answer(tmp_path) == "22"
    for kept in (ROOT / "app" / "__pycache__").glob("room-*"):
        shutil.rmtree(kept)
