"""Buttons and keys that move the arm as long as they are held, with what they move between them.

A held button sends its wish twenty times a second, and once more that it was let go; if that is
lost, the wish lapses in the arm (`app.control.jogging`). viser's own hotkeys know of no letting
go, and begin to repeat only after half a second. So a key presses its button here: a listener of
the page's own does with the keyboard what the mouse does, and only while the button is on screen.
"""

import json
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np
import viser

from app.actions import Jog, JogJoints
from app.messages import Array, Snapshot
from app.poses import turns
from app.ui.access import words
from app.ui.engine import Engine
from app.ui.inside import uuid_of
from app.ui.pacing import Every
from app.ui.words import link_words

RATE = 20.0  # [1/s] of a held button
AXES = ("x", "y", "z", "rx", "ry", "rz")
BASE, TOOL, VIEW = "Base", "Tool", "View"
FRAMES = {
    BASE: "along the axes of the robot's base", TOOL: "along the tool's own axes",
    VIEW: "as you look at it: x to the right, y up, z towards you",
}  # fmt: skip
# by `KeyboardEvent.code`: back and ahead of each axis; none of them is the camera's or a command
WAYS = ("KeyK", "KeyI", "KeyL", "KeyJ", "KeyO", "KeyU")
KEYS = (*WAYS, *(f"Shift+{key}" for key in WAYS))
HINT = "Keys in this tab: I K, J L, U O; with Shift they turn. 1 to 9: joints, with Shift back."

STYLE = """<style>
div:has(> div > .jog-grid) { display: grid; align-items: center; gap: 0.25em 0.3em;
  grid-template-columns: repeat(2, 2.5em minmax(0, 1fr) 2.5em); padding: 0.2em 0.6em 0.5em }
div:has(> div > .jog-grid) > div { margin: 0 !important; padding: 0 !important; min-width: 0 }
div:has(> div > .jog-grid) button { padding: 0; height: 2em !important; touch-action: none }
div:has(> .jog-grid) { display: none }
</style><span class="jog-grid"></span>"""

# The listener lives as long as the window and looks for its buttons each time: what is not drawn
# or may not be used here has none, so keys are dead in every other tab and on pages that watch.
SCRIPT = """
if (!window.flinchJog) {
  const held = new Map();
  const fire = (e, kind) =>
    e.dispatchEvent(new PointerEvent(kind, {bubbles: true, button: 0, pointerId: -7}));
  const up = code => {
    const e = held.get(code);
    if (!e) return;
    held.delete(code);
    fire(e, 'pointerup');
    e.click();
  };
  const allUp = () => [...held.keys()].forEach(up);
  document.addEventListener('keydown', event => {
    if (event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest('input, textarea, select, [contenteditable=true]')) return;
    const id = window.flinchJog[(event.shiftKey ? 'Shift+' : '') + event.code];
    const e = id && document.getElementById(id);
    if (!e || e.disabled || e.offsetParent === null || held.has(event.code)) return;
    held.set(event.code, e);
    fire(e, 'pointerdown');
  });
  document.addEventListener('keyup', event => up(event.code));
  window.addEventListener('blur', allUp);
  document.addEventListener('visibilitychange', allUp);
}
window.flinchJog = KEYS;
"""


class JogPad:
    """The six axes of the tool, and the joints."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        gui, robot = server.gui, engine.robot
        self._engine, self._pace = engine, Every(0.2)
        self._keys: dict[str, str] = {}
        self.frame = gui.add_button_group("Axes of", tuple(FRAMES), hint=_listed(FRAMES))
        self.chosen = gui.add_html("")
        self.axes: list[viser.GuiButtonHandle] = []
        self.joints: list[viser.GuiButtonHandle] = []
        self._names = [link_words(j.removesuffix("_joint")) for j in robot.joints]
        self._slides = robot.slides
        with gui.add_folder("Tool"):
            gui.add_html(STYLE)
            self._poses = [
                self._row(gui, self.axes, name, KEYS[2 * k : 2 * k + 2], self._axis(k))
                for k, name in _in_columns(AXES)
            ]
        with gui.add_folder("Joints"):
            gui.add_html(STYLE)
            self._angles = [
                self._row(gui, self.joints, str(k + 1), _digits(k), self._joint(k))
                for k in range(robot.n)
            ]
        self.keys = gui.add_html(keys_html(self._keys))
        self._order = [k for k, _ in _in_columns(AXES)]
        self._choose(BASE)

        @self.frame.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            self._choose(event.target.value)

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        robot, T = self._engine.robot, snapshot.T_base_tool
        values = [f"{round(1000.0 * v)} mm" for v in T[:3, 3]]
        values += [f"{round(np.degrees(v))}°" for v in turns(T)]
        for k, label in zip(self._order, self._poses, strict=True):
            label.content = value_html(AXES[k], values[k])
        for k, label in enumerate(self._angles):
            low, high, q = robot.q_min[k], robot.q_max[k], snapshot.joints.q[k]
            unit, scale = ("mm", 1000.0) if self._slides[k] else ("°", 180.0 / np.pi)
            label.content = value_html(
                self._names[k], f"{round(scale * q)}{unit}", float((q - low) / (high - low)),
                f"{self._names[k]}: {scale * low:.0f} to {scale * high:.0f}{unit}",
            )  # fmt: skip

    def _choose(self, frame: str) -> None:
        self._frame = frame
        self.chosen.content = small_html(f"{frame}: {FRAMES[frame]}")

    def _row(
        self, gui: Any, buttons: list[viser.GuiButtonHandle], name: str, keys: Sequence[str],
        wish: Callable[[float, Any], Jog | JogJoints],
    ) -> viser.GuiHtmlHandle:  # fmt: skip
        """A button back, what it moves, and a button ahead."""
        back = self._button(gui, f"\u2212{name}", keys[0], wish, -1.0)
        label: viser.GuiHtmlHandle = gui.add_html(value_html(name, ""))
        buttons += [back, self._button(gui, f"+{name}", keys[1], wish, 1.0)]
        return label

    def _button(
        self, gui: Any, label: str, key: str, wish: Callable[[float, Any], Jog | JogJoints],
        share: float,
    ) -> viser.GuiButtonHandle:  # fmt: skip
        button: viser.GuiButtonHandle = gui.add_button(label, color="gray")
        self._keys[key] = uuid_of(button)

        @button.on_hold(callback_hz=RATE)
        async def _(event: Any) -> None:
            self._engine.post(wish(share, event))

        @button.on_click
        async def _(event: Any) -> None:  # it was let go
            self._engine.post(wish(0.0, event))

        return button

    def _axis(self, k: int) -> Callable[[float, Any], Jog]:
        def wish(share: float, event: Any) -> Jog:
            axes: Array | None = None if self._frame == TOOL else np.eye(3)
            if self._frame == VIEW:
                axes = viewed(event.client.camera.wxyz)
            shares = tuple(share if i == k else 0.0 for i in range(6))
            return Jog(shares, axes, by_hand(event))

        return wish

    def _joint(self, k: int) -> Callable[[float, Any], JogJoints]:
        n = self._engine.robot.n

        def wish(share: float, event: Any) -> JogJoints:
            return JogJoints(tuple(share if i == k else 0.0 for i in range(n)), by_hand(event))

        return wish


def viewed(wxyz: Array) -> Array:
    """(3, 3) axes as a person looks: x right, y up, z back. A camera has y down and z ahead."""
    R = viser.transforms.SO3(np.asarray(wxyz, dtype=np.float64)).normalize().as_matrix()
    return np.asarray(R @ np.diag([1.0, -1.0, -1.0]))


def by_hand(event: Any) -> str:
    """Why the arm is where it is."""
    return f"moved by hand at {words(event.client_id)}"


def keys_html(keys: dict[str, str]) -> str:
    """The keys in words, and what makes them press the buttons, by uuid."""
    # what a page is given as HTML runs no scripts, but does tell when a picture cannot be drawn
    script = SCRIPT.replace("KEYS", json.dumps(keys))
    return f'{small_html(HINT)}<img src="data:," style="display:none" onerror="{escape(script)}">'


def small_html(words: str) -> str:
    """A line of help."""
    return f'<div style="font-size:0.75em;padding:0 1em 0.4em">{escape(words)}</div>'


def value_html(name: str, value: str, share: float | None = None, hint: str = "") -> str:
    """What a pair of buttons moves; with `share` 0..1 of its range as a bar."""
    bar = ""
    if share is not None:
        left = 100.0 * min(max(share, 0.0), 1.0)
        bar = (
            '<div style="height:3px;border-radius:2px;background:rgba(128,128,128,0.35);'
            'position:relative"><div style="position:absolute;top:-2px;width:3px;height:7px;'
            f'background:currentColor;left:calc({left:.1f}% - 1px)"></div></div>'
        )
    return (
        f'<div title="{escape(hint)}" style="font-size:0.78em;line-height:1.25">'
        '<div style="display:flex;flex-wrap:wrap;justify-content:center;column-gap:0.4em;'
        'white-space:nowrap">'
        f'<span style="overflow:hidden;text-overflow:ellipsis">{escape(name)}</span>'
        f"<b>{escape(value)}</b></div>{bar}</div>"
    )


def _listed(choices: dict[str, str]) -> str:
    return "; ".join(f"{name}: {about}" for name, about in choices.items())


def _in_columns(names: Sequence[str]) -> list[tuple[int, str]]:
    """Ways in the left column, turns in the right one."""
    half = len(names) // 2
    return [(k, names[k]) for row in range(half) for k in (row, row + half)]


def _digits(k: int) -> tuple[str, str]:
    """Keys of joint k, back and ahead."""
    return f"Shift+Digit{k + 1}", f"Digit{k + 1}"
