"""The queue between two processes."""

import pytest

from app.sensing.ring import Ring

SIZE, COUNT = 12, 5


@pytest.fixture
def memory():
    return bytearray(Ring.room(SIZE, COUNT))


@pytest.fixture
def ring(memory):
    return Ring(memoryview(memory), SIZE, COUNT)


def record(i):
    return i.to_bytes(SIZE, "little")


def test_records_come_out_as_they_went_in_round_after_round(ring):
    sent = taken = 0
    for step in (3, 5, 1, 4, 5, 2) * 10:
        while not ring.full and sent - taken < step:
            ring.put(record(sent))
            sent += 1
        assert ring.waiting == sent - taken
        while ring.waiting:
            assert ring.first() == ring.first() == record(taken)
            ring.drop()
            taken += 1
    assert taken > 20 * COUNT and ring.first() is None


def test_both_sides_see_one_queue(memory, ring):
    other = Ring(memoryview(memory), SIZE, COUNT)
    for i in range(COUNT):
        ring.put(record(i))
    assert ring.full and other.full and other.first() == record(0)
    other.drop()
    assert not ring.full


def test_a_record_that_is_not_yet_whole_is_not_taken(memory, ring):
    for i in range(COUNT):
        ring.put(record(i))
        ring.drop()
    before = bytes(memory)
    ring.put(record(77))
    seen, late = bytes(memory), slice(16, len(memory))  # the count is there, the record not
    memory[late] = before[late]
    assert ring.waiting == 1 and ring.first() is None
    memory[late] = seen[late]
    assert ring.first() == record(77)


def test_the_counts_of_a_ring_behind_another_lie_on_whole_words():
    assert all(Ring.room(size, COUNT) % 8 == 0 for size in range(1, 40))
