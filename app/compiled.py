"""How numerical kernels are compiled: one version of each, on first use, kept on disk.

Three rules keep the compiler out of a running arm's tick.

One kind of array. To numba a read-only array is another type than a writable one, and what
travels between rooms is frozen: each new mixture was another compilation, up to nine seconds
long, in the tick that met it first. Here a read-only array counts as a writable one. Explicit
signatures that declare read-only inputs would do as well and cost the same to call (1.2 us for
eight arrays, 2.3 us where they are frozen, either way), but they do not reach into named
tuples. The price: the compiler no longer refuses to write into what is frozen, so a kernel
writes only what its docstring says it does.

One version for those who call from Python. A number is what the annotation says, whatever the
first caller gave; any other difference is an error at once, not a second compilation.

Nothing old. numba renews a kept kernel when its own file changes, but freezes into it what it
takes from other files, constants and kernels. So what is kept lies in a folder named after the
contents of the kernel's file and of all that it imports, directly or not. Files above it, the
page's say, may change without a word. (numba itself tells processors apart.)

Kernels keep the interpreter's lock. A tick calls a dozen of them, each shorter than 0.3 ms; when
they gave the lock away, the page's thread took it each time and a tick waited for it as often.
"""

import hashlib
import logging
import os
import pickle
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba.core import event, sigutils, types
from numba.core.registry import CPUDispatcher
from numba.extending import typeof_impl

from app.paths import cache_home

log = logging.getLogger(__name__)
APP = Path(__file__).parent
OPTIONS = {"nopython": True, "nogil": False, "fastmath": False}
NUMBERS = {float: types.float64, int: types.int64, bool: types.boolean}
IMPORT = re.compile(r"^\s*(?:from|import) ([\w.]+)(?: import (\([^)]*\)|.*))?", re.M)
REMEMBERED = 16  # tuples of arguments, of each kernel
P = ParamSpec("P")
R = TypeVar("R")
Progress = Callable[[int, int, str], None]  # number, of how many, name
config: Any = numba.config  # its settings are made at run time
kernels: list["Kernel"] = []  # all that have been defined
_kind_of: Any = typeof_impl.dispatch(np.ndarray)
_Dispatcher: Any = CPUDispatcher  # numba says nothing of its types


@typeof_impl.register(np.ndarray)
def _one_kind(array: Any, context: Any) -> Any:
    """The type of an array, frozen or not."""
    kind = _kind_of(array, context)
    return kind if kind.mutable else kind.copy(readonly=False)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """A kernel: its one version is kept until its file or anything that it imports changes.

    To the checker of types it stays the function that it was, arguments and answer.
    """
    before = config.CACHE_DIR
    config.CACHE_DIR = _folder(function.__module__)
    kernel = Kernel(function)
    try:
        kernel.enable_caching()
        kernel.keep_if_possible()
    except (OSError, RuntimeError) as e:  # there is no folder that can be written to
        _unkept(e)
    finally:
        config.CACHE_DIR = before
    kernels.append(kernel)
    return cast(Callable[P, R], kernel)


class Kernel(_Dispatcher):
    """A compiled function with one version for those who call it from Python."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function, targetoptions=dict(OPTIONS))
        self._numbers = [NUMBERS.get(kind) for kind in function.__annotations__.values()]
        self._version: tuple[Any, ...] = ()
        self._tuples: dict[int, tuple[Any, Any]] = {}  # id: the tuple and its type, oldest first

    def typeof_pyval(self, value: Any) -> Any:
        """numba's, which looks at every array of a tuple in every call, 0.6 us each; a tuple is
        what it was, so those seen last are remembered."""
        if not isinstance(value, tuple):
            return super().typeof_pyval(value)
        seen = self._tuples.pop(id(value), None)
        if seen is None or seen[0] is not value:
            seen = value, super().typeof_pyval(value)
            if len(self._tuples) >= REMEMBERED:
                del self._tuples[next(iter(self._tuples))]
        self._tuples[id(value)] = seen
        return seen[1]

    def keep_if_possible(self) -> None:
        """Let a kernel that cannot be kept, on a full disk, be used all the same."""
        keep, load = self._cache.save_overload, self._cache.load_overload

        def save_overload(signature: Any, data: Any) -> None:
            try:
                keep(signature, data)
            except OSError as e:
                _unkept(e)

        def load_overload(signature: Any, context: Any) -> Any:
            try:
                return load(signature, context)
            except (OSError, EOFError, ValueError, pickle.PickleError) as e:
                _unkept(e)  # half of a file, or one that may not be read
                return None

        self._cache.save_overload, self._cache.load_overload = save_overload, load_overload

    def compile(self, signature: Any) -> Any:
        """numba's, with the numbers of the annotation."""
        return super().compile(self._settled(sigutils.normalize_signature(signature)[0]))

    def _compile_for_args(self, *args: Any, **named: Any) -> Any:
        """numba's, which is asked where no version fits the arguments of a call from Python."""
        version = self._settled(tuple(self.typeof_pyval(a) for a in args))
        names = self.py_func.__code__.co_varnames  # the arguments come first among them
        for name, new, old in zip(names, version, self._version or version, strict=False):
            if new != old or not _contiguous(new):
                raise TypeError(
                    f"{self.__name__} has one version, which takes {name} as {old}, and only "
                    f"contiguous arrays, not {new}; give it such a one"
                )
        self._version = version
        return super()._compile_for_args(*args, **named)

    def _settled(self, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(
            number if number and isinstance(kind, types.Number | types.Boolean) else kind
            for kind, number in zip(kinds, self._numbers, strict=False)
        )


@cache
def _say_once(words: str) -> None:
    log.warning("%s", words)


def _unkept(error: Exception) -> None:
    """Say, once for each reason, that every start has to compile."""
    why = getattr(error, "strerror", None) or "no folder can be written to"
    _say_once(
        f"compiled kernels cannot be kept ({why}), so every start takes a minute longer; make "
        "room, or name a folder in XDG_CACHE_HOME"
    )


def _contiguous(kind: Any) -> bool:
    """Is an array, or every array of a tuple, contiguous?"""
    if isinstance(kind, types.BaseTuple):
        parts: Any = kind  # numba says nothing of its types
        return all(map(_contiguous, parts.types))
    return getattr(kind, "layout", "C") == "C"


@contextmanager
def told(progress: Progress) -> Iterator[None]:
    """While this lasts, `progress` is told of every kernel that is compiled, none from disk."""
    listener = _Teller(progress)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)


class _Teller(event.Listener):
    def __init__(self, progress: Progress) -> None:
        self._progress, self._begun = progress, set[int]()

    def on_start(self, event: Any) -> None:
        kernel = event.data["dispatcher"]
        if any(kernel is k for k in kernels):  # numba compiles functions of its own as well
            self._begun.add(id(kernel))
            self._progress(len(self._begun), len(kernels), kernel.__name__)

    def on_end(self, event: Any) -> None:
        """Nobody asks."""


@cache
def _folder(module: str) -> str:
    """Where the kernels of a module are kept."""
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted(_needs(_file(module)) | {Path(__file__)}):
        digest.update(_content(file))
    beside = APP / "__pycache__"
    if not os.access(beside if beside.is_dir() else APP, os.W_OK):
        beside = cache_home() / "flinch"
    return str(beside / f"{module}-{digest.hexdigest()[:12]}")


def _file(module: str) -> Path:
    path = sys.modules[module].__file__
    assert path is not None
    return Path(path)


def _needs(file: Path) -> set[Path]:
    """The file and all of its package that it imports, directly or not."""
    seen, ahead = set(), {file}
    while ahead:
        file = ahead.pop()
        seen.add(file)
        ahead |= _imports(file) - seen
    return seen


@cache
def _imports(file: Path) -> frozenset[Path]:
    """Files of the same package that a file imports itself."""
    root = file.parent
    while (root / "__init__.py").exists():
        root = root.parent
    found = set()
    for module, names in IMPORT.findall(_content(file).decode()):
        for name in (module, *(f"{module}.{n}" for n in re.findall(r"\w+", names))):
            path = root.joinpath(*name.split("."))
            found.add(path.with_suffix(".py") if path.suffix == "" else path)
            found.add(path / "__init__.py")
    return frozenset(f for f in found if f.is_file())


@cache
def _content(file: Path) -> bytes:
    return file.read_bytes()
