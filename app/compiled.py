"""How numerical kernels are compiled: on first use, kept on disk.

They keep the interpreter's lock. A tick calls a dozen of them, each shorter than 0.3 ms; when
they gave the lock away, the page's thread took it each time and a tick waited for it as often.

numba renews a kept kernel when its own file changes, but not when a kernel that it calls in
another file does: an edited helper then goes on living in its callers. So what is kept lies
in a folder named after the contents of all kernels of the same room.
"""

import hashlib
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

APP = Path(__file__).parent
config: Any = numba.config  # its settings are made at run time


def compiled(function: Callable[..., Any]) -> Any:
    """numba's `njit`, its result kept until any kernel of the room changes."""
    path = sys.modules[function.__module__].__file__
    assert path is not None
    before = config.CACHE_DIR
    config.CACHE_DIR = _folder(Path(path).parent)
    try:
        return numba.njit(cache=True, nogil=False, fastmath=False)(function)
    finally:
        config.CACHE_DIR = before


@cache
def _folder(room: Path) -> str:
    digest = hashlib.sha256(numba.__version__.encode() + Path(__file__).read_bytes())
    for file in sorted(room.glob("*.py")):
        text = file.read_bytes()
        if b"app.compiled" in text:
            digest.update(file.name.encode() + text)
    beside = APP / "__pycache__"
    if not os.access(beside if beside.is_dir() else APP, os.W_OK):
        beside = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flinch"
    return str(beside / f"{room.name}-{digest.hexdigest()[:12]}")
