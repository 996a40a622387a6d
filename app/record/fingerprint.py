"""What the last bit of a command depends on beside the Inputs: machine, versions, code, facts."""

import hashlib
import platform
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding

from app import __version__
from app.robot.model import Robot
from app.robot.skin import Skin

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "pin", "daqp", "proxsuite", "embreex")
CODE = Path(__file__).parents[1]
# what a brain is made of; the rest may change without a word
ROOMS = ("*.py", "cell/*.py", "control/**/*.py", "perception/**/*.py", "robot/*.py", "sensing/*.py")


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Where these are equal, equal Inputs give equal Outputs.

    versions: of what computes, by name.   processor: its kind and what it can.
    code:     digest of the program's text, constants and all.
    robot:    digest of the robot's facts.   skin: of the skin's.
    """

    versions: tuple[tuple[str, str], ...]
    processor: str
    code: str
    robot: str
    skin: str

    def differences(self, other: "Fingerprint") -> tuple[str, ...]:
        """What is not the same, in words; empty where all is."""
        ours, theirs = dict(self.versions), dict(other.versions)
        found = [
            f"{name} {ours.get(name, 'missing')} instead of {theirs.get(name, 'missing')}"
            for name in sorted({*ours, *theirs})
            if ours.get(name) != theirs.get(name)
        ]
        words = {"processor": "another processor", "code": "another state of Flinch's own code",
                 "robot": "another robot", "skin": "another skin"}  # fmt: skip
        found += [w for name, w in words.items() if getattr(self, name) != getattr(other, name)]
        return tuple(found)


def fingerprint_of(robot: Robot, skin: Skin) -> Fingerprint:
    """Of this machine and program, with these facts."""
    return Fingerprint(*_here(), facts_digest(robot), facts_digest(skin))


def facts_digest(facts: Any) -> str:
    """Digest of every number and text of a robot or a skin; not of where its files lie."""
    sha = hashlib.blake2b(digest_size=8)
    for part in _facts(facts):
        sha.update(part)
    return sha.hexdigest()


def _facts(value: Any) -> Iterator[bytes]:
    if isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, bool | int | float | str | None):
        yield f"{value!r};".encode()
    elif isinstance(value, tuple):
        for part in value:
            yield from _facts(part)
    elif is_dataclass(value) and not isinstance(value, type):
        for f in fields(value):
            if not f.name.startswith("_"):
                yield from _facts(getattr(value, f.name))


@cache
def _here() -> tuple[tuple[tuple[str, str], ...], str, str]:
    versions = [("flinch", __version__), ("python", platform.python_version())]
    versions += [(name, version(name)) for name in PACKAGES]
    features = binding.get_host_cpu_features()
    able = ",".join(sorted(name for name, has in features.items() if has))
    can = hashlib.blake2b(able.encode(), digest_size=4).hexdigest()
    processor = f"{platform.machine()} {binding.get_host_cpu_name()} {can}"
    sha = hashlib.blake2b(digest_size=8)
    for file in sorted({f for pattern in ROOMS for f in CODE.glob(pattern)}):
        sha.update(f"{file.relative_to(CODE)}\0".encode())
        sha.update(file.read_bytes())
    return tuple(versions), processor, sha.hexdigest()
