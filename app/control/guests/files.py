"""Others' controllers by file: FILE.py or FILE.py:CLASS becomes a mode like any other.

    class Mine:
        def __init__(self, arm): ...
        def act(self, frames, joints, goal): return qd

`app.control.guests.arm` is the arm, `app.control.guests.frames` the frames; `joints` a
`JointState`, `goal` the pose (4, 4) of the tool or None, `qd` (n,) joint velocities [rad/s].
"""

import hashlib
import re
import sys
import traceback
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from app.assets import asset_folder
from app.config import Params
from app.control.registry import controller, forget, kinds
from app.errors import ConfigError, options
from app.needs import Needs
from app.text_file import read_text

if TYPE_CHECKING:  # a name is checked before kernels are wanted
    from app.control.clearance import Clearance
    from app.control.guests.controller import GuestController
    from app.robot.model import Robot

GUEST = r".*?\.py(?::[A-Za-z_]\w*)?"
_here: dict[str, str] = {}  # digest of the file by mode


def is_guest(name: str) -> bool:
    """Is this the name of a file with a controller?"""
    return re.fullmatch(GUEST, name) is not None


def welcome(name: str) -> str:
    """Make the guest of a name known as a mode of that name, and anew if its file has changed.

    ConfigError for a file that is not there or fails, and for a class that is not there or is no
    controller.
    """
    digest = guest_digest(name)
    if _here.get(name) == digest and name in kinds():
        return name
    path, _, wanted = _parted(name)
    kind = _class(path, _module(path, digest), wanted)
    if name in kinds():
        forget(name)
    about = (kind.__doc__ or f"a controller of {path.name}").strip().splitlines()[0]

    def make(robot: "Robot", clearance: "Clearance") -> "GuestController":
        from app.control.guests.controller import GuestController

        return GuestController(robot, name, kind)

    label = name.rpartition("/")[2]
    controller(name, label, about, needs=_needs, distances=_distances, studies=frozenset())(make)
    _here[name] = digest
    return name


def guest_digest(name: str) -> str:
    """Of the file and its place; ConfigError where it cannot be read."""
    path, text, _ = _parted(name)
    return hashlib.blake2b(f"{path.resolve()}\n{text}".encode(), digest_size=4).hexdigest()


def tells_row(name: str) -> bool:
    """Does the guest tell which of the near pairs it acts on, by an attribute `row`?"""
    path, _, wanted = _parted(welcome(name))
    return hasattr(_class(path, sys.modules[_title(guest_digest(name))], wanted), "row")


def _needs(params: Params) -> Needs:
    """What our own are given: several pairs a link, up to where avoidance begins."""
    return Needs("several", params.avoidance_begins)


def _distances(params: Params) -> tuple[float, float]:
    return params.distance_kept, params.avoidance_begins


def _title(digest: str) -> str:
    return f"flinch_guest_{digest}"


def _parted(name: str) -> tuple[Path, str, str]:
    """File, its text, and class of a name; a file that is not found may be a shipped one."""
    file, colon, wanted = name.rpartition(":")
    if not colon or not file.endswith(".py"):
        file, wanted = name, ""
    path, shipped = Path(file), asset_folder("static_assets") / "benchmark"
    if not path.is_file():
        path = shipped / file
    if not path.is_file():
        known = options(file, (p.name for p in shipped.glob("*.py")))
        raise ConfigError(f"no file {file!r} with a controller; give its path; {known}")
    return path, read_text(path, ConfigError), wanted


def _module(path: Path, digest: str) -> ModuleType:
    """The file, run once; beside it may lie what it imports."""
    module = ModuleType(_title(digest))
    module.__file__ = str(path)
    folder = str(path.parent.resolve())
    if folder not in sys.path:
        sys.path.append(folder)
    sys.modules[module.__name__] = module
    try:
        exec(compile(read_text(path, ConfigError), str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as e:
        del sys.modules[module.__name__]
        lines = [t.lineno for t in traceback.extract_tb(e.__traceback__) if t.filename == str(path)]
        at = getattr(e, "lineno", None) or (lines[-1] if lines else 0)
        raise ConfigError(f"{path}, line {at}: {e!r}; mend the file") from e
    return module


def _class(path: Path, module: ModuleType, wanted: str) -> Any:
    """The wanted class, or the only one that acts."""
    own = {k: v for k, v in vars(module).items() if isinstance(v, type)}
    own = {k: v for k, v in own.items() if v.__module__ == module.__name__}
    if wanted and wanted not in own:
        raise ConfigError(f"{path}: no class {wanted!r}; {options(wanted, own)}")
    acting = [k for k, v in own.items() if callable(getattr(v, "act", None))]
    if wanted and wanted not in acting:
        raise ConfigError(
            f"{path}: class {wanted} has no act(self, frames, joints, goal); write one"
        )
    if not wanted and len(acting) != 1:
        what = f"has the classes {', '.join(acting)}" if acting else "has no class with an act"
        raise ConfigError(f"{path}: {what}; give FILE.py:CLASS with an act(frames, joints, goal)")
    return own[wanted or acting[0]]
