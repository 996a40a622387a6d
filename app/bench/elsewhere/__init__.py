"""Peers whose pins clash with ours: run by an interpreter of their own, on inputs from a file.

`make peers-env` makes the environments, beside our own packages. Each script here is run by
one of them, reads arrays from one file and writes arrays to another; it imports nothing of
ours. One thread, like everything that is compared.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import StudyError

HERE = Path(__file__).parent
ENVIRONMENTS = Path(sys.prefix) / "peers"
PATIENCE = 600.0  # [s] for one script


def interpreter(name: str) -> Path | None:
    """The Python of a peer's environment, None where `make peers-env` has not been run."""
    path = ENVIRONMENTS / name / "bin" / "python"
    return path if path.exists() else None


def run(name: str, **job: NDArray[np.generic]) -> dict[str, NDArray[np.generic]]:
    """Run the script of a peer on arrays; returns the arrays that it answers with."""
    python = interpreter(name)
    if python is None:
        raise StudyError(f"{name} has no environment; make it with: make peers-env")
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder, "job.npz"), Path(folder, "answer.npz")
        np.savez(asked, **job)  # type: ignore[arg-type]
        command = [str(python), str(HERE / f"{name}_peer.py"), str(asked), str(answered)]
        env = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
        done = subprocess.run(
            command, env=env, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise StudyError(f"{name} failed: {last}; see its environment in {python.parents[1]}")
        with np.load(answered) as found:
            return dict(found)
