"""The brain's state: taken, put back, written and read, to the last bit."""

from collections import Counter, deque
from dataclasses import dataclass, replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    KeepBackground,
    LearnBackground,
    RunProgram,
    SetMode,
    SetParams,
)
from app.brain import FACTS, LATER
from app.config import MODES
from app.digest import digest
from app.errors import RecordingError
from app.messages import Mode
from app.rehearsal import SWITCHES, turned
from app.setup import Setup
from app.state import Room, capture, frozen, restore
from app.state_bytes import from_bytes, name_of, places, to_bytes
from app.timing import ManualClock
from app.wiring import build_engine

CELL = Setup(scene="cell", seed=1, rate=125.0, program="door-screws")
BALL = AddObstacle("ball", {"kind": "sphere", "radius_m": 0.08}, (0.5, 0.5, 0.5))


@pytest.fixture(scope="module")
def engine():
    engine = build_engine(CELL, ManualClock())
    k, skin = engine.skin.index("ring2-03"), engine.skin
    T = engine.step().T_base_link[skin.link[k]]
    seen = T[:3, :3] @ (skin.origin[k] + 0.4 * skin.axis[k]) + T[:3, 3]
    engine.post(replace(BALL, position=tuple(seen.tolist())))
    step(engine, 0.3)
    engine.post(LearnBackground(0.3))
    step(engine, 0.5)
    engine.post(KeepBackground())
    step(engine, 0.3)
    return engine


def step(engine, seconds):
    """The ticks of some seconds."""
    count = round(seconds * CELL.rate)
    ticks = engine.subscribe(count)
    for _ in range(count):
        engine.step()
    return ticks.take()


def same_again(brain, ticks):
    for x, out in ticks:
        assert digest(brain.tick(x)) == digest(out), f"tick {x.tick}"


def test_a_brain_put_back_does_the_same_again_as_often_as_wanted(engine):
    brain = engine.brain
    for room in (None, Room()):
        state, before = brain.capture(room), brain.digest()
        engine.post(SetParams({"mode": "wb"}))
        ticks = step(engine, 0.4)
        after = brain.digest()
        for _ in range(2):
            brain.restore(state)
            assert brain.digest() == before
            same_again(brain, ticks)
            assert brain.digest() == after


def test_another_brain_goes_on_from_a_state_that_was_written(engine):
    brain, other = engine.brain, engine.brain.sibling("sm")
    data, before = brain.written(brain.capture()), brain.digest()
    ticks = step(engine, 0.3)
    state = other.read(data)
    for _ in range(2):
        other.restore(state)
        assert other.digest() == before
        same_again(other, ticks)
        assert other.digest() == brain.digest()


def test_a_state_is_written_as_it_was_captured_however_long_ago(engine):
    state = engine.brain.capture()
    data = engine.brain.written(state)
    step(engine, 0.3)
    assert engine.brain.written(state) == data


def test_what_was_learned_bounds_the_motion_of_a_brain_that_is_put_back(engine):
    brain = engine.brain
    other = brain.sibling("qp")
    assert len(brain._perception.background.known) and not len(other._perception.background.known)
    other.restore(other.read(brain.written(brain.capture())))
    ours, theirs = brain._controllers._clearance, other._controllers._clearance
    assert np.array_equal(ours.cell_cases, theirs.cell_cases)
    assert digest(ours.parts) == digest(theirs.parts)


def test_a_state_needs_no_class_that_a_new_brain_or_the_list_does_not_have():
    engine = build_engine(CELL, ManualClock())
    brain = engine.brain
    _, _, known = places(vars(brain.sibling("qp")), FACTS)
    met = set()
    asked = [
        *({"mode": mode} for mode in MODES),
        *({s: getattr(turned(brain.params, s), s)} for s in SWITCHES),
    ]
    for change in asked:
        engine.post(SetParams(change))
        step(engine, 0.1)
        met |= places(vars(brain), FACTS)[2]
    for action in (SetMode(Mode.STOPPED), SetMode(Mode.RUNNING), RunProgram("")):
        engine.post(action)
        step(engine, 0.1)
        met |= places(vars(brain), FACTS)[2]
    assert met - known <= set(LATER)


def test_no_array_that_is_shared_as_frozen_ever_changes(engine):
    brain = engine.brain
    shared, seen = [], [vars(brain)]
    visited = set()
    while seen:  # every frozen array of the state
        part = seen.pop()
        if id(part) in visited or isinstance(part, FACTS) or callable(part):
            continue
        visited.add(id(part))
        if isinstance(part, np.ndarray):
            shared += [(part, part.copy())] if frozen(part) else []
        elif isinstance(part, dict):
            seen += part.values()
        elif isinstance(part, list | tuple | deque):
            seen += part
        elif hasattr(part, "__dict__"):
            seen += vars(part).values()
        elif hasattr(part, "__slots__"):
            seen += [getattr(part, s) for s in part.__slots__]
    assert len(shared) > 20
    step(engine, 0.4)
    assert all(np.array_equal(a, copy, equal_nan=True) for a, copy in shared)


def test_no_two_arrays_of_the_state_lie_on_the_same_memory(engine):
    """Else they would do so no more in a brain that reads it."""
    arrays = [a for a, _ in engine.brain.capture().arrays if a.nbytes]
    spans = sorted(np.lib.array_utils.byte_bounds(a) for a in arrays)
    assert all(end <= begin for (_, end), (begin, _) in pairwise(spans))


# --- the walk itself -------------------------------------------------------------------------


@dataclass
class Part:
    number: float
    near: object = None


@dataclass(slots=True)
class Slim:
    values: list


class Whole:
    """A bit of everything, in circles and shared."""

    def __init__(self):
        self.array = np.arange(6.0).reshape(2, 3)
        self.view = self.array[1]
        self.list, self.queue = [1, 2], deque([1, 2], maxlen=2)
        self.counter, self.table, self.set = Counter("aab"), {"a": 1, (1, 2): None}, {3, 4}
        self.part = Part(1.0, self)
        self.slim = Slim([self.list])
        self.scalar, self.mode = np.float64(0.1), Mode.IDLE
        self.large = 1.5

    def turn(self):
        self.array += 1.0
        self.list.append(3)
        self.queue.append(3)
        self.counter.update("b")
        self.table["b"] = self.table.pop("a")
        self.set.add(5)
        self.part.number += 1.0
        self.part.near = None
        self.slim.values = []
        self.scalar, self.mode, self.large, self.new = np.float64(0.2), Mode.RUNNING, 2, 1
        del self.view


def test_whatever_holds_something_holds_it_again_and_shares_what_it_shared():
    whole = Whole()
    state, before = capture(vars(whole)), digest(vars(whole))
    for _ in range(2):
        whole.turn()
        assert digest(vars(whole)) != before
        restore(state)
        assert digest(vars(whole)) == before
        assert np.shares_memory(whole.view, whole.array) and whole.slim.values[0] is whole.list
        assert whole.part.near is whole and whole.queue.maxlen == 2


def test_what_was_written_is_read_into_another_one():
    whole, other = Whole(), Whole()
    whole.part.near = whole.part  # a circle
    whole.view = None
    whole.turn()
    whole.view, whole.table = None, {"only": whole.list}
    other.new = 0
    state = from_bytes(to_bytes(capture(vars(whole)), ()), vars(other), (), ())
    restore(state)
    assert digest(vars(other)) == digest(vars(whole))
    assert other.table["only"] is other.list and other.queue.maxlen == 2
    assert type(other.counter) is Counter and type(other.scalar) is np.float64


def test_a_state_that_cannot_be_read_is_refused_when_it_is_taken():
    with pytest.raises(TypeError, match="memoryview"):
        capture([memoryview(b"x")])
    with pytest.raises(TypeError, match="only numbers"):
        to_bytes(capture([np.array(["a"])]), ())


NEEDS_A_CLASS = [11, "subprocess.Popen", ["args"], ["true"]]


@pytest.mark.parametrize(
    "nodes",
    [
        [[6, "a", [1]], NEEDS_A_CLASS],
        [[6, "a", [1]], [11, "builtins.eval", [], []]],
        [[6, "a", [1]], [11, name_of(Part), ["number", "other"], [1.0, 2.0]]],
        [[6, "a", [1]], [11, name_of(Whole), ["turn"], [1.0]]],
        [[6, "a", [1]], [11, name_of(dict), ["turn"], [1.0]]],
        [[6, "a", [1]], [0, "|O", [1], True, b"12345678"]],
        [[6, "a", [1]], [0, "<f8", [1 << 40], True, b"12345678"]],
        [[6, "a", [1]], [4, [1]]],
        [[6, "a", [1]], [3, ["/part"]]],
        [[6, "a", [1]], [2, name_of(Whole), 1]],
        [[6, "a", [7]]],
        [[6, "a", [-1]]],
        [[99]],
        [[6, "b", 1]],
        [],
        7,
    ],
)
def test_bytes_of_another_make_or_with_evil_in_them_make_nothing(nodes):
    root = {"a": [Part(1.0), Whole()]}
    with pytest.raises(RecordingError, match="does not fit"):
        from_bytes(msgspec.msgpack.encode(nodes), root, (), ())


def test_torn_bytes_make_nothing():
    data = to_bytes(capture({"a": [1, 2]}), ())
    for end in range(len(data)):
        with pytest.raises(RecordingError, match="does not fit"):
            from_bytes(data[:end], {"a": []}, (), ())
