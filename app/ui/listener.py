"""The listening socket: so many connections a second, of each neighbourhood and of all.

asyncio accepts whoever comes, as fast as they come; and when file handles run out it writes
a line for each try, thousands in a second, since it goes on trying and starts anew once for
every try. So what it accepts is counted here, before anything is spent on it: too many of one
neighbourhood are closed at once, and when there are too many altogether, or no handles, the
listener is left alone for a second (asyncio does that when it hears of missing buffers).
Whoever is inside does not notice.
"""

import asyncio
import errno
import ipaddress
import socket

from app.errors import ServerError
from app.timing import Clock
from app.ui.paced_log import PacedLog
from app.ui.pacing import Bucket, Shares

RATE, BURST = 400.0, 400.0  # [1/s] connections accepted at all, most of them only to be closed
SHARE, SHARE_BURST = 50.0, 150.0  # [1/s] of one neighbourhood; a page takes three when it loads
DEAF = 0.05  # [s] for asyncio to come to the end of its tries before it leaves us alone
OUT = (errno.EMFILE, errno.ENFILE)


class PausedError(OSError):
    """Tells asyncio to leave the listener alone for a second."""

    def __init__(self) -> None:
        super().__init__(errno.ENOBUFS, "the listener pauses")


class Listener(socket.socket):
    """A bound socket that asyncio accepts from."""

    def __init__(self, bound: socket.socket, clock: Clock, log: PacedLog) -> None:
        """Takes `bound` over."""
        super().__init__(fileno=bound.detach())
        self._clock, self._paced = clock, log
        self._all, self._shares = Bucket(RATE, BURST), Shares(SHARE, SHARE_BURST)
        self._deaf_until = float("-inf")

    def accept(self) -> tuple[socket.socket, object]:
        """The next connection that is let in. Raises as asyncio wants it: see above."""
        time = asyncio.get_running_loop().time()
        if time < self._deaf_until:
            raise BlockingIOError(errno.EAGAIN, "the listener pauses")
        while True:
            try:
                connection, address = super().accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                raise
            except OSError as e:
                out = "no file handles are left (ulimit -n)" if e.errno in OUT else str(e)
                self._paced.tell("accept", f"no page can come for a second: {out}")
                self._deaf_until = time + DEAF
                raise PausedError from e
            now = self._clock.now()
            if not self._all.take(now):
                connection.close()
                self._paced.tell("flood", f"more than {RATE:g} connections a second: a pause")
                self._deaf_until = time + DEAF
                raise PausedError
            if self._shares.take(neighbourhood(address[0]), now):
                return connection, address
            connection.close()
            self._paced.tell("share", f"too many connections from {address[0]}: closed")


def neighbourhood(host: str) -> str:
    """An IPv4 address; of an IPv6 address the net, since its owner has all 2^64 of them."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if address.version == 4:
        return host
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((address, 64), strict=False))


def bound(host: str, port: int) -> socket.socket:
    """A socket that listens at exactly this port (0 = any free one), or a `ServerError`."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as e:
        if e.errno == errno.EADDRINUSE:
            raise ServerError(
                f"port {port} on {host} is taken; stop the other program or give another port "
                "(0 = any free one)"
            ) from e
        raise ServerError(
            f"cannot listen on {host}:{port} ({e.strerror or e}); "
            "give an address of this machine, such as 127.0.0.1, and a port you may use"
        ) from e
