"""Places that are short of something: no home, a full disk, few handles, little memory, Ctrl-C."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app import compiled as kernels
from app.cli import main
from app.cli.doctor import Doctor
from app.cli.scarce import scarce
from app.compiled import compiled
from app.paths import cache_home
from app.robot import file_cache

ROOT = Path(kernels.__file__).parent.parent


@compiled
def doubled(x: float) -> float:
    return 2.0 * x


def test_a_kernel_that_cannot_be_kept_is_used_all_the_same_and_that_is_said(monkeypatch, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    kernels._say_once.cache_clear()
    monkeypatch.setattr(doubled._cache, "_save_overload", full, raising=False)
    for cache in (doubled._cache._impl, doubled._cache):
        if hasattr(cache, "_cache_file"):
            monkeypatch.setattr(cache._cache_file, "save", full)
            monkeypatch.setattr(cache._cache_file, "load", lambda *_: None)
    assert doubled(2.0) == 4.0
    assert "cannot be kept (No space left on device)" in caplog.text
    assert "XDG_CACHE_HOME" in caplog.text


def test_a_folder_for_kernels_that_cannot_be_made_costs_only_their_keeping(monkeypatch, caplog):
    kernels._say_once.cache_clear()

    def nowhere(_):
        raise RuntimeError("no locator available")

    def tripled(x: float) -> float:
        return 3.0 * x

    monkeypatch.setattr(kernels.Kernel, "enable_caching", nowhere)
    monkeypatch.setattr(kernels, "kernels", [])
    assert compiled(tripled)(2.0) == 6.0
    assert "every start takes a minute longer" in caplog.text


def test_a_user_without_a_home_has_no_cache_folder_and_needs_none(monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    assert cache_home() == Path("/nonexistent/.cache")


def test_what_is_made_goes_with_the_process_where_the_cache_is_full(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def make(folder):
        if tmp_path in folder.parents:
            raise OSError(errno.ENOSPC, "No space left on device")
        (folder / "a").write_text("b")

    folder = file_cache.cached_folder("covers", "key", make)
    assert (folder / "a").read_text() == "b" and tmp_path not in folder.parents
    assert "No space left on device" in caplog.text
    assert not list((tmp_path / "flinch/covers").iterdir())  # nothing half done


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (OSError(errno.ENOSPC, "", "/a/b"), "/a/b: the disk is full"),
        (OSError(errno.EROFS, "", "/a/b"), "/a/b: the disk is full or may not be written to"),
        (OSError(errno.EMFILE, "Too many open files"), "ulimit -n 4096"),
        (OSError(errno.ENOMEM, ""), "too little memory"),
        (MemoryError(), "too little memory"),
        (RuntimeError("can't start new thread"), "no more threads"),
        (ImportError("x.so: failed to map segment: Cannot allocate memory"), "too little memory"),
    ],
)
def test_what_a_machine_is_short_of_is_one_line_with_the_remedy(monkeypatch, capsys, error, says):
    monkeypatch.setattr(Doctor, "__call__", lambda self: (_ for _ in ()).throw(error))
    assert main(["doctor", "ur10e"]) == 1
    line = capsys.readouterr().err
    assert line.startswith("flinch: ") and says in line and line.count("\n") == 1


def test_any_other_error_keeps_its_trace(monkeypatch):
    assert scarce(OSError(errno.EIO, "")) == ""
    monkeypatch.setattr(Doctor, "__call__", lambda self: (_ for _ in ()).throw(OSError(5, "io")))
    with pytest.raises(OSError, match="io"):
        main(["doctor", "ur10e"])


def test_handlers_of_signals_are_as_before_after_a_command(monkeypatch):
    before = signal.getsignal(signal.SIGINT)
    assert main(["doctor", "no-such-robot"]) == 1
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.slow
@pytest.mark.parametrize("wait", [0.3, 0.6, 1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("command", [("run", "--port", "0", "--no-open"), ("doctor", "ur10e")])
def test_an_interrupt_at_any_moment_of_the_start_ends_it_without_a_trace(command, wait):
    process = subprocess.Popen(
        [sys.executable, "-m", "app", *command], cwd=ROOT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    time.sleep(wait)  # this process is another one's: no clock of ours moves it
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=15)
    assert process.returncode in (0, 1, 130, -signal.SIGINT) and "Traceback" not in said
