"""Bytes from an open port as they come: a device, a TCP socket, or a bridge of RFC 2217."""

import errno
import os
import select
import socket
import termios
from collections.abc import Callable

import serial

PATIENCE = 0.2  # [s] a read waits so long for bytes
CHUNK = 1 << 12  # [bytes] at most at once, as many as a line holds
SOCKET, BRIDGE = "socket://", "rfc2217://"
# [s] idle, [s] between two probes, and probes until a peer that says nothing counts as gone
KEEP_ALIVE = ((socket.TCP_KEEPIDLE, 2), (socket.TCP_KEEPINTVL, 1), (socket.TCP_KEEPCNT, 3))


def reader_of(device: serial.SerialBase, name: str) -> Callable[[], bytes]:
    """What gives the bytes that have come, none after `PATIENCE`; an OSError when nobody is there.

    pyserial sets the line up; its own reads of a device cost four times the system's.
    """
    if name.startswith(SOCKET):
        return _of_socket(device)
    if name.startswith(BRIDGE):
        return _of_bridge(device)
    line = device.fileno()
    wait_in_kernel(line)

    def read() -> bytes:
        chunk = os.read(line, CHUNK)
        if not chunk and _hung_up(line):
            raise OSError(errno.EIO, "hung up")
        return chunk

    return read


def wait_in_kernel(line: int) -> None:
    """Let a read return with the first bytes, or with none after `PATIENCE`."""
    os.set_blocking(line, True)
    settings = termios.tcgetattr(line)
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, round(10.0 * PATIENCE)
    termios.tcsetattr(line, termios.TCSANOW, settings)


def _of_socket(device: serial.SerialBase) -> Callable[[], bytes]:
    line = device.fileno()
    with socket.socket(fileno=os.dup(line)) as end:  # options are the connection's
        end.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in KEEP_ALIVE:
            end.setsockopt(socket.IPPROTO_TCP, option, value)

    def read() -> bytes:
        if not select.select([line], [], [], PATIENCE)[0]:
            return b""
        chunk = os.read(line, CHUNK)
        if not chunk:
            raise OSError(errno.ECONNRESET, "closed by the other side")
        return chunk

    return read


def _of_bridge(device: serial.SerialBase) -> Callable[[], bytes]:
    device.timeout = PATIENCE

    def read() -> bytes:
        return bytes(device.read(min(max(device.in_waiting, 1), CHUNK)))

    return read


def _hung_up(line: int) -> bool:
    """Did a read give nothing because there is nobody, not because nothing was said?"""
    poll = select.poll()
    poll.register(line, select.POLLIN)
    return any(event & (select.POLLHUP | select.POLLERR) for _, event in poll.poll(0))
