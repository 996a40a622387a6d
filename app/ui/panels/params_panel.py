"""Every setting as a slider or a box, in the words of the one place where they are described.

Lengths are shown in millimetres; all else as it is. What another window sets appears here;
what is being set here is not overwritten meanwhile.
"""

from math import floor, log10
from typing import Any

import viser

from app.actions import SetParams
from app.config import Tunable, tunables
from app.messages import Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign

FIRST = ("distance_kept", "goal_speed", "joint_speed", "memory")
ELSEWHERE = ("mode",)  # the control panel has it
MM = 1000.0
PERIOD = 0.2  # [s]
Control = viser.GuiSliderHandle[float] | viser.GuiCheckboxHandle | viser.GuiDropdownHandle[str]


class ParamsPanel:
    """The settings used often on top, the rest in closed folders."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        self._gui, self._engine, self._clock = server.gui, engine, clock
        self.controls: dict[str, Control] = {}
        self._pace = Every(PERIOD)
        self._hands: dict[str, HandsOff] = {}
        known = {t.name: t for t in tunables() if t.name not in ELSEWHERE}
        for name in FIRST:
            self._add(known[name])
        rest = [t for t in known.values() if t.name not in FIRST]
        for group in dict.fromkeys(t.group for t in rest):
            with self._gui.add_folder(f"More: {group.lower()}", expand_by_default=False):
                for t in rest:
                    if t.group == group:
                        self._add(t)

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        for name, control in self.controls.items():
            if self._hands[name].free:
                value = getattr(snapshot.params, name)
                number = isinstance(value, float)
                assign(control, shown(value, _UNITS[name]) if number else value)

    def _add(self, t: Tunable) -> None:
        self._hands[t.name] = HandsOff(self._clock)
        handle: Control
        if t.kind is bool:
            handle = self._gui.add_checkbox(t.label, t.default, hint=t.help)
        elif t.choices:
            handle = self._gui.add_dropdown(
                t.label, t.choices, initial_value=t.default, hint=t.help
            )  # fmt: skip
        else:
            assert t.low is not None and t.high is not None  # numbers always have a range
            low, high = shown(t.low, t.unit), shown(t.high, t.unit)
            unit = "mm" if t.unit == "m" else t.unit
            handle = self._gui.add_slider(
                f"{t.label} [{unit}]" if unit else t.label,
                min=low,
                max=high,
                step=step(low, high),
                initial_value=shown(t.default, t.unit),
                hint=t.help,
            )
        self.controls[t.name] = handle

        async def changed(event: viser.GuiEvent[Any]) -> None:
            self._change(t, event)

        handle.on_update(changed)

    def _change(self, t: Tunable, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is None:  # the page itself showed what another window has set
            return
        self._hands[t.name].touch()
        value = event.target.value
        if t.kind is float:
            value = clamped(value / MM if t.unit == "m" else value, t)
        self._engine.post(SetParams({t.name: value}))


_UNITS = {t.name: t.unit for t in tunables()}


def shown(value: float, unit: str) -> float:
    """The number on the page of a value in SI."""
    return round(float(value) * MM, 6) if unit == "m" else float(value)


def clamped(value: float, t: Tunable) -> float:
    """`value` inside its range: rounding for display may leave it by a hair."""
    assert t.low is not None and t.high is not None
    return min(max(value, t.low), t.high)


def step(low: float, high: float) -> float:
    """A round step, a hundredth to a thousandth of the range."""
    return float(10.0 ** floor(log10((high - low) / 100.0)))
