"""A queue of records between two processes, in memory that both see.

One side puts, the other takes. Neither waits for the other nor asks the system for anything, so
that neither gives the interpreter's lock away: a thread that did would wait for it until its
neighbours have had their turn. A record bears a checksum of itself and its number, since a
processor may show another one the count before the record.
"""

from struct import Struct
from zlib import crc32

_CHECK = Struct("<Q")
_HEAD = 16  # bytes: records put and records taken, each written by one side alone


class Ring:
    """Up to `count` records of `size` bytes in `memory`; as many zeros are an empty one."""

    def __init__(self, memory: memoryview, size: int, count: int) -> None:
        self._memory, self._size, self._count = memory, size, count
        self._step = _step(size)
        self._put_taken = memory[:_HEAD].cast("q")

    @staticmethod
    def room(size: int, count: int) -> int:
        """Bytes of memory that a ring needs."""
        return _HEAD + count * _step(size)

    @property
    def waiting(self) -> int:
        """Records that have been put and not been taken."""
        return self._put_taken[0] - self._put_taken[1]

    @property
    def full(self) -> bool:
        """Must a record be taken before another can be put?"""
        return self.waiting >= self._count

    def put(self, record: bytes | bytearray) -> None:
        """Append a record; the ring must not be full."""
        number = self._put_taken[0]
        at = self._place(number)
        _CHECK.pack_into(self._memory, at, crc32(record, number & 0xFFFFFFFF))
        self._memory[at + _CHECK.size : at + _CHECK.size + self._size] = record
        self._put_taken[0] = number + 1

    def first(self) -> bytes | None:
        """The oldest record, left where it is; None without one."""
        put, number = self._put_taken
        if number == put:
            return None
        at = self._place(number)
        record = bytes(self._memory[at + _CHECK.size : at + _CHECK.size + self._size])
        whole = _CHECK.unpack_from(self._memory, at)[0] == crc32(record, number & 0xFFFFFFFF)
        return record if whole else None

    def drop(self) -> None:
        """Make room: the oldest record has been dealt with."""
        self._put_taken[1] += 1

    def _place(self, number: int) -> int:
        return _HEAD + number % self._count * self._step


def _step(size: int) -> int:
    """Bytes from record to record; whole words, so that a count behind them is written at once."""
    return _CHECK.size + -(-size // 8) * 8
