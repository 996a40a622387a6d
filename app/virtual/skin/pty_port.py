"""A port that this program itself speaks at: a pseudo terminal with a name of its own."""

import os
import select
import tty
from pathlib import Path
from types import TracebackType
from typing import Self

from app.errors import SensorError

BACKLOG = 1 << 20  # [bytes] that may wait for a slow reader: ten seconds of a whole skin


class PtyPort:
    """A pseudo terminal behind the symbolic link `link`; a context manager takes it away.

    Like a real line it waits for nobody: what is written while no program has the port open, or
    while one does not keep up, is lost.
    """

    def __init__(self, link: Path) -> None:
        self.link = link
        self.lost = 0  # packets that nobody took in time
        self._pending = b""
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._device = os.ttyname(slave)
        os.close(slave)  # so that a hang-up tells whether somebody listens
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, 0)
        try:
            if link.is_symlink():
                link.unlink()
            link.symlink_to(self._device)
        except OSError as e:
            os.close(self._master)
            raise SensorError(
                f"{link}: cannot be made a link ({e.strerror}); give a new name with --link"
            ) from e

    @property
    def heard(self) -> bool:
        """Has a program opened the port?"""
        return not self._poll.poll(0)

    def write(self, packet: bytes) -> None:
        """Say a packet, or lose it whole."""
        if not self.heard:
            self._pending = b""
            return
        if len(self._pending) + len(packet) > BACKLOG:
            self.lost += 1
            return
        self._pending += packet
        try:
            sent = os.write(self._master, self._pending)
        except BlockingIOError:
            return
        self._pending = self._pending[sent:]

    def close(self) -> None:
        """Unplug."""
        os.close(self._master)
        if self.link.is_symlink() and os.readlink(self.link) == self._device:
            self.link.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
