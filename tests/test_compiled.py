"""Kernels that are kept on disk must never outlive what they are made of."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from app.compiled import compiled

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


class Pair(NamedTuple):
    """What a kernel is given together."""

    a: np.ndarray
    b: np.ndarray


@compiled
def total(pair: Pair) -> float:
    return pair.a.sum() + pair.b.sum()


def test_a_tuple_that_was_seen_is_not_taken_for_another_one() -> None:
    floats = [Pair(np.full(3, float(i)), np.ones(i + 1)) for i in range(3)]
    for pair in floats * 2:  # the second time they are remembered
        assert total(pair) == pair.a.sum() + pair.b.sum()
    frozen = Pair(np.arange(3.0), np.arange(4.0))
    for array in frozen:
        array.flags.writeable = False
    assert total(frozen) == 9.0
    with pytest.raises(TypeError, match="total has one version"):
        total(Pair(np.arange(3.0), np.arange(4)))
    for i in range(40):  # more than are remembered
        assert total(Pair(np.full(2, float(i)), np.zeros(1))) == 2.0 * i
    assert total(floats[0]) == 1.0
