"""What is a message of a page and what is not: whatever comes, it is judged and never raises."""

from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from viser import _messages

from app.ui.wire import KNOWN, MalformedError, UnusedError, decoded, misfit
from tests.raw_page import CAMERA

CONTROLS: dict[str, tuple[Any, dict[str, Any]]] = {
    "button": (False, {}),
    "slider": (0.5, {"min": 0.0, "max": 1.0}),
    "whole number": (3, {"min": 0, "max": 10}),
    "number": (0.5, {"min": None, "max": None}),
    "vector": ((1.0, 2.0, 3.0), {}),
    "text": ("", {}),
    "dropdown": ("a", {"options": ("a", "b")}),
}
numbers = st.floats() | st.integers()
anything = st.recursive(
    st.none() | st.booleans() | numbers | st.text(max_size=5) | st.binary(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=8,
)
fields = st.sampled_from(
    ["uuid", "updates", "name", "owner", "phase", "wxyz", "position", "start_position",
     "end_position", "button", "modifier", "instance_index", "fov", "image_width", "look_at"]
)  # fmt: skip


def control(kind: str, disabled: bool = False) -> Any:
    value, props = CONTROLS[kind]
    return SimpleNamespace(value=value, disabled=disabled, **props)


def judge(raw: bytes) -> None:
    try:
        message = decoded(raw)
    except (MalformedError, UnusedError):
        return
    assert type(message) in KNOWN.values()


def test_a_pages_own_messages_are_known() -> None:
    camera = {"type": CAMERA["kind"], **{k: v for k, v in CAMERA.items() if k != "kind"}}
    message = decoded(msgspec.msgpack.encode(camera))
    assert isinstance(message, _messages.ViewerCameraMessage)
    assert message.position == (1.0, -2.0, 1.0)


CLICK = {
    "type": "ScenePointerMessage", "event_type": "click", "ray_origin": [1.0, 2.0, 3.0],
    "ray_direction": [0.0, 0.0, 1.0], "screen_pos": [[0.5, 0.5]], "modifier": None,
}  # fmt: skip


def test_a_click_in_the_scene_is_known_by_its_ray() -> None:
    message = decoded(msgspec.msgpack.encode(CLICK))
    assert isinstance(message, _messages.ScenePointerMessage)
    assert message.ray_origin == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("change", "error"),
    [({"event_type": "rect-select"}, UnusedError), ({"ray_origin": None}, MalformedError),
     ({"screen_pos": [[0.5, 0.5], [0.6, 0.6]]}, MalformedError),
     ({"screen_pos": [0.5]}, MalformedError), ({"ray_direction": [0.0, 1.0]}, MalformedError),
     ({"ray_direction": [float("nan"), 0.0, 1.0]}, UnusedError)],
)  # fmt: skip
def test_no_other_click_in_the_scene_passes(change: dict[str, Any], error: type) -> None:
    with pytest.raises(error):
        decoded(msgspec.msgpack.encode(CLICK | change))


@given(st.binary(max_size=300))
@settings(max_examples=500)
def test_any_bytes_are_judged(raw: bytes) -> None:
    judge(raw)


@given(st.sampled_from(sorted(KNOWN)), st.dictionaries(fields, anything, max_size=6))
@settings(max_examples=200)
def test_any_fields_of_a_known_message_are_judged(kind: str, table: dict[str, Any]) -> None:
    try:
        raw = msgspec.msgpack.encode({"type": kind, **table})
    except OverflowError:  # beyond 64 bits nothing can be sent
        return
    judge(raw)


@given(anything)
@settings(max_examples=300)
def test_any_value_is_judged_by_every_control(value: Any) -> None:
    for kind in CONTROLS:
        misfit(control(kind), {"value": value})
        misfit(control(kind), value)


@pytest.mark.parametrize(
    ("kind", "value"),
    [("button", True), ("slider", 0), ("slider", 25), ("whole number", 10),
     ("number", -1e9), ("vector", [1, 2, 3.5]), ("text", "x" * 256), ("dropdown", "b")],
)  # fmt: skip
def test_what_a_hand_chooses_is_let_through(kind: str, value: Any) -> None:
    assert misfit(control(kind), {"value": value}) == ""


@pytest.mark.parametrize(
    ("kind", "value"),
    [("button", 1), ("slider", True), ("slider", float("inf")),
     ("number", "1"), ("vector", [1, 2]), ("vector", "123"),
     ("text", "x" * 257), ("text", 5), ("dropdown", "c")],
)  # fmt: skip
def test_what_no_hand_can_choose_is_not(kind: str, value: Any) -> None:
    assert misfit(control(kind), {"value": value}) != ""


def test_a_disabled_control_cannot_be_used() -> None:
    assert misfit(control("button", disabled=True), {"value": True}) == "it is disabled"
