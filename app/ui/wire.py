"""What a well-formed message of a page is: anything else is refused before viser sees it.

viser believes what it is sent: a control's update may name any attribute of its handle (also
the list of its callbacks) and hold any value, and a value of the wrong kind ends in a trace
of a task. So a message is decoded here first; only kinds that this page uses are known, a
control is only ever given a value, of a kind which a hand could have chosen.
"""

from dataclasses import fields
from math import isfinite
from typing import Any, cast

import msgspec
import viser
from viser import _messages as m

from app.errors import FlinchError
from app.ui.entrance import LONGEST

WATCHING: tuple[type[m.Message], ...] = (m.ViewerCameraMessage,)
OPERATING: tuple[type[m.Message], ...] = (
    m.GuiUpdateMessage,
    m.GuiButtonHoldMessage,
    m.CommandTriggerMessage,
    m.TransformControlsDragStartMessage,
    m.TransformControlsUpdateMessage,
    m.TransformControlsDragEndMessage,
    m.SceneNodeClickMessage,
    m.SceneNodeDragMessage,
    m.ScenePointerMessage,
)
# No uploads, no forms, no render replies, no share tunnel: the page has no use for them.
KNOWN = {kind.__name__: kind for kind in (*WATCHING, *OPERATING)}
LENGTHS = {
    "wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3, "start_position": 3,
    "end_position": 3, "ray_origin": 3, "ray_direction": 3, "screen_pos": 2,
    "start_screen_pos": 2, "end_screen_pos": 2,
}  # fmt: skip


class MalformedError(FlinchError):
    """Bytes that no page sends."""


class UnusedError(FlinchError):
    """A message of viser's for which there is no use here."""


def decoded(raw: bytes | str) -> m.Message:
    """The message in `raw`. Raises `MalformedError` or `UnusedError`."""
    if isinstance(raw, str):
        raise MalformedError("text instead of bytes")
    try:
        table = msgspec.msgpack.decode(raw)
    except (msgspec.MsgspecError, ValueError, RecursionError) as e:
        raise MalformedError(f"bytes that cannot be decoded ({e})") from e
    kind = table.get("type") if isinstance(table, dict) else None
    if not isinstance(kind, str):
        raise MalformedError("no message with a type")
    if kind not in KNOWN:
        raise UnusedError(f"{kind[:60]!r} is nothing that a page sends here")
    names = {f.name for f in fields(KNOWN[kind])} | {"type"}  # type: ignore[arg-type]
    if not set(table) <= names:
        raise MalformedError(f"a {kind} with fields that it does not have")
    _check(kind, table)
    try:
        return cast(m.Message, m.Message.deserialize(raw))
    except Exception as e:  # whatever viser stumbles over, it is no message
        raise MalformedError(f"a {kind} that cannot be read ({e})") from e


def misfit(handle: viser.GuiInputHandle[Any], updates: Any) -> str:
    """Why a hand at a page cannot have changed the control so; empty if it can."""
    if not isinstance(updates, dict) or set(updates) != {"value"}:
        return "it sets more than the value"
    if handle.disabled:
        return "it is disabled"
    new, old = updates["value"], handle.value
    options = getattr(handle, "options", None)
    if options is not None:
        return "" if new in options else "no such option"
    if isinstance(old, bool):
        return "" if isinstance(new, bool) else "not yes or no"
    if isinstance(old, (int, float)):
        # not its range: a number that is being typed leaves it on the way (2 for 250)
        return "" if _number(new) else "not a number"
    if isinstance(old, tuple):
        good = isinstance(new, (list, tuple)) and len(new) == len(old) and all(map(_number, new))
        return "" if good else "not as many numbers as it has"
    if isinstance(old, str):
        good = isinstance(new, str) and len(new) <= LONGEST
        return "" if good else f"not a text of at most {LONGEST} characters"
    return "nothing that can be sent"


def _check(kind: str, table: dict[str, Any]) -> None:
    for name in ("name", "uuid", "owner", "phase"):
        if not isinstance(table.get(name, ""), str):
            raise MalformedError(f"a {kind} whose {name} is no text")
    for name, length in LENGTHS.items():
        value = table.get(name)
        if value is None:
            continue
        if (kind, name) == ("ScenePointerMessage", "screen_pos") and isinstance(value, list):
            value = value[0] if len(value) == 1 else ()  # a click is a list of one place
        if not isinstance(value, list) or len(value) != length:
            raise MalformedError(f"a {kind} whose {name} is not {length} numbers")
        if not all(map(_number, value)):  # a page that is a few pixels small may say so
            raise UnusedError(f"a {kind} whose {name} is not finite")
    if kind == "ScenePointerMessage":
        if table.get("event_type") != "click":
            raise UnusedError("a rectangle drawn over the scene")
        if None in (table.get("ray_origin"), table.get("ray_direction")):
            raise MalformedError("a click in the scene without its ray")
    if not _number(table.get("frequency", 1.0)):
        raise MalformedError(f"a {kind} whose frequency is no number")
    wxyz = table.get("wxyz")
    if wxyz is not None and not 0.5 < sum(v * v for v in wxyz) < 2.0:
        raise UnusedError(f"a {kind} whose wxyz is no rotation")


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value)
