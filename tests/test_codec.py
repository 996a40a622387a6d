"""Values into bytes and back: to the last bit, of known kinds only."""

from dataclasses import fields, replace
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from app import actions
from app.cell.learned import Learned
from app.cell.parts import Box, Cell, HalfSpace
from app.config import Params
from app.config_names import NOW
from app.control.programs import shipped_programs
from app.errors import RecordingError
from app.messages import Goal, JointState, Mode, SensorFrame
from app.record.codec import Decoder, encode
from app.record.kinds import NAMES, VALUES
from app.robot.tables import Choice
from app.setup import Setup
from app.tick import ArmReport, Inputs, SourceReport

numbers = st.floats(width=64)
texts = st.text(st.characters(exclude_categories=()), max_size=8)  # halves of characters as well
plain = st.recursive(
    st.none() | st.booleans() | st.integers() | numbers | texts | st.binary(max_size=8)
    | st.builds(np.float64, numbers) | st.builds(np.int64, st.integers(-(2**63), 2**63 - 1)),
    lambda inner: st.lists(inner, max_size=3) | st.tuples(inner, inner)
    | st.dictionaries(texts, inner, max_size=3),
)  # fmt: skip


def arrays(dtype=np.float64, shape=None):
    return nps.arrays(dtype, shape or nps.array_shapes(max_dims=2, max_side=4, min_side=0))


triples = st.tuples(numbers, numbers, numbers)
shares = st.lists(numbers, max_size=7).map(tuple)
by_action = {
    actions.SetGoal: st.builds(actions.SetGoal, arrays()),
    actions.SetParams: st.builds(
        actions.SetParams,
        st.dictionaries(texts.filter(lambda t: t not in NOW), plain, max_size=3),
    ),
    actions.SetMode: st.builds(actions.SetMode, st.sampled_from(Mode), texts),
    actions.AddObstacle: st.builds(
        actions.AddObstacle, texts, st.dictionaries(texts, plain, max_size=3), triples
    ),
    actions.MoveObstacle: st.builds(actions.MoveObstacle, texts, arrays()),
    actions.RemoveObstacle: st.builds(actions.RemoveObstacle, texts),
    actions.SetPose: st.builds(actions.SetPose, triples, triples),
    actions.RunProgram: st.builds(actions.RunProgram, texts),
    actions.LearnBackground: st.builds(actions.LearnBackground, numbers),
    actions.KeepBackground: st.builds(actions.KeepBackground),
    actions.DiscardBackground: st.builds(actions.DiscardBackground),
    actions.ForgetBackground: st.builds(actions.ForgetBackground),
    actions.Jog: st.builds(actions.Jog, shares, st.none() | arrays(), texts),
    actions.RunTaught: st.builds(
        actions.RunTaught,
        texts,
        st.lists(st.builds(actions.Place, arrays(), numbers), max_size=3).map(tuple),
    ),
    actions.JogJoints: st.builds(actions.JogJoints, shares, texts),
    actions.Want: st.builds(actions.Want, arrays(), st.none() | arrays(), arrays(), texts),
    actions.GoHome: st.builds(actions.GoHome),
    actions.UseSensor: st.builds(actions.UseSensor, texts, st.booleans()),
    actions.SpoilSensor: st.builds(actions.SpoilSensor, texts, texts),
    actions.SetPerson: st.builds(actions.SetPerson, texts),
    actions.PauseWorld: st.builds(actions.PauseWorld, st.booleans()),
    actions.StepWorld: st.builds(actions.StepWorld, numbers),
    actions.Remark: st.builds(actions.Remark, texts, st.booleans()),
}
any_action = st.one_of(*by_action.values())
frames = st.builds(
    SensorFrame, st.integers(0, 99), numbers, st.integers(0, 1 << 40), arrays(),
    arrays(np.uint8), arrays(np.uint8),
)  # fmt: skip
inputs = st.builds(
    Inputs, st.integers(0, 1 << 40), numbers, numbers, numbers,
    st.builds(JointState, numbers, arrays(), arrays()), arrays(),
    st.builds(ArmReport, texts, texts, st.booleans(), numbers),
    st.lists(frames, max_size=3).map(tuple),
    st.builds(
        SourceReport, arrays(np.bool_), texts, texts,
        st.lists(st.tuples(texts, texts), max_size=2).map(tuple),
        st.none() | arrays(np.bool_), texts,
    ),
    st.lists(any_action, max_size=3).map(tuple), texts, texts,
)  # fmt: skip


def alike(a, b):
    """The same kind, the same bits."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray | np.generic):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, float):
        return np.float64(a).tobytes() == np.float64(b).tobytes()
    if isinstance(a, dict):
        return alike(list(a.items()), list(b.items()))
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(alike, a, b))
    if type(a) in VALUES.values():
        return all(alike(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return a == b


def again(value):
    return Decoder().decode(encode(value), type(value))


def test_every_action_that_there_is_is_tried_here():
    assert set(by_action) == set(get_args(actions.Action))


@given(any_action)
def test_an_action_comes_back_as_it_was(action):
    assert alike(again(action), action)


@settings(max_examples=60)
@given(inputs)
def test_inputs_come_back_to_the_last_bit(x):
    assert alike(again(x), x)


@given(arrays(st.sampled_from([np.float32, np.int16, np.int64, np.uint8, np.bool_, np.float64])))
def test_an_array_comes_back_read_only_contiguous_and_aligned(array):
    for a in (array, array.T, array[::2]):
        (b,) = again((a,))
        assert alike(b, np.ascontiguousarray(a).reshape(a.shape))
        assert not b.flags.writeable and b.flags.aligned and b.flags.c_contiguous


def test_what_a_brain_is_born_with_comes_back_as_it_was():
    T = np.eye(4)
    cell = Cell(
        "a cell", (Box("b", T, np.ones(3)),), (HalfSpace("p", T, np.ones(2)),),
        Learned.of(np.array([[1, -2, 3]])),
    )  # fmt: skip
    setup = Setup(background=Path("a/b.toml"), choice=Choice(home_deg=(1.0, 2.0)), cell="x", seed=3)
    for value in (cell, setup, Params(mode="sm", solver="proxqp"), Goal(T), shipped_programs()):
        assert alike(again(value), value)


def test_what_is_not_known_is_refused_when_it_is_written():
    for value in (object(), 1j, np.array(["a"]), np.array([None]), {1: memoryview(b"")}):
        with pytest.raises(RecordingError, match="cannot be recorded"):
            encode(value)


def recorded_with(kind, names, values):
    return Decoder(NAMES | {kind: names}).decode(
        msgspec.msgpack.encode([kind, *values]), VALUES[kind]
    )


def test_a_setting_that_was_renamed_since_is_known_by_its_old_name():
    old = [{new: old for old, new in NOW.items()}.get(n, n) for n in NAMES["Params"]]
    assert old != list(NAMES["Params"])
    params = Params(distance_kept=0.3, way_round=True)
    values = [getattr(params, n) for n in NAMES["Params"]]
    assert recorded_with("Params", old, values) == params
    change = actions.SetParams({"d_s": 0.3, "way_round": True})
    assert again(change).changes == {"distance_kept": 0.3, "way_round": True}


def test_a_setting_that_came_later_has_its_default():
    assert recorded_with("Params", ["distance_kept"], [0.3]) == Params(distance_kept=0.3)


@pytest.mark.parametrize(
    ("kind", "names", "values", "words"),
    [
        ("Params", ["k_g"], [1.0], "a constant of the method now"),
        ("Params", ["footprint"], [True], "choose mode = 'paper'"),
        ("Params", ["never"], [1.0], "another version"),
        ("Params", ["distance_kept"], [7.0], "give a value from"),
        ("Goal", ["pose"], [1.0], "another version"),
        ("JointState", ["stamp", "q"], [1.0, 2.0], "has no JointState.qd"),
        ("Goal", ["T_base_tool", "T_base_tool"], [1.0, 2.0], "another version"),
    ],
)
def test_a_field_that_is_not_known_any_more_is_refused_with_a_clear_word(
    kind, names, values, words
):
    with pytest.raises(RecordingError, match=words) as e:
        recorded_with(kind, names, values)
    assert "\n" not in str(e.value)


@pytest.mark.parametrize(
    "evil",
    [
        ["Popen", ["true"]],
        ["subprocess.Popen", [0, "true"]],
        ["Robot"],
        ["Goal"],
        ["Goal", 1, 2],
        [3, "|O", [1], b"12345678"],
        [3, "<f8", [1 << 60], b"12345678"],
        [3, "<f8", [1], b"1234"],
        [4, "|S8", b"12345678"],
        [5, "Goal", 1],
        [5, "Mode", "flying"],
        [7, "1" * 5000],
        [99, 1],
        [],
        [None],
        [[1]],
        {"a": 1},
        7,
    ],
)
def test_nothing_but_known_kinds_is_made_of_evil_bytes(evil):
    with pytest.raises(RecordingError):
        Decoder().decode(msgspec.msgpack.encode(evil), Goal)


def test_a_file_may_list_no_kind_of_its_own():
    with pytest.raises(RecordingError, match="'Popen', which is not known here"):
        Decoder({"Popen": ["args"]}).decode(msgspec.msgpack.encode(["Popen", "true"]), Goal)


@settings(max_examples=200)
@given(st.binary(max_size=60))
def test_rubbish_is_refused_in_one_line(data):
    with pytest.raises(RecordingError) as e:
        Decoder().decode(data, Inputs)
    assert "\n" not in str(e.value)


def test_torn_bytes_are_refused():
    x = SensorFrame(1, 2.0, 3, np.ones(4), np.ones(4, np.uint8), np.ones(4, np.uint8))
    data = encode(x)
    for end in range(len(data)):
        with pytest.raises(RecordingError):
            Decoder().decode(data[:end], SensorFrame)
    assert alike(again(replace(x, sequence=1 << 70)), replace(x, sequence=1 << 70))
