"""The settings in words: three that matter, how careful they are, and the rest for experts.

Lengths are shown in millimetres; all else as it is. What another window sets appears here; what is
being set here is not overwritten meanwhile. What the controller in force does not use is grey.
"""

from collections.abc import Mapping
from html import escape
from math import floor, log10
from typing import Any

import viser

from app.actions import Remark, SetParams
from app.config import Params, Tunable, load_params, tunables
from app.config_text import toml
from app.control.registry import kind_of, used
from app.errors import FlinchError
from app.messages import Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign
from app.ui.shelf import Shelf

FIRST = ("distance_kept", "goal_speed", "memory")
ELSEWHERE = ("mode",)  # the control panel has it
# what is at its default in "normal"
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "careful": {"distance_kept": 0.35, "goal_speed": 0.15, "joint_speed": 0.25, "memory": True},
    "normal": {},
    "bold": {"distance_kept": 0.12, "goal_speed": 0.6, "joint_speed": 0.8, "memory": False},
}
OF_PRESETS = tuple(dict.fromkeys(name for preset in PRESETS.values() for name in preset))
MM = 1000.0
PERIOD = 0.2  # [s]
ALL = "all of them"
NOTHING = "(nothing)"
Control = viser.GuiSliderHandle[float] | viser.GuiCheckboxHandle | viser.GuiDropdownHandle[str]


class ParamsPanel:
    """Presets and the big three on top, the rest in a closed folder, and the files beneath."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, clock: Clock, shelf: Shelf | None = None
    ) -> None:
        """shelf: where settings are saved; None: nowhere."""
        self._gui, self._engine, self._clock, self._shelf = server.gui, engine, clock, shelf
        self.controls: dict[str, Control] = {}
        self._pace = Every(PERIOD)
        self._hands: dict[str, HandsOff] = {}
        self._params = Params()
        known = {t.name: t for t in tunables() if t.name not in ELSEWHERE}
        self.preset = self._gui.add_button_group(
            "How", tuple(PRESETS), hint="distance, speeds and memory together"
        )
        for name in FIRST:
            self._add(known[name])
        self.told = self._gui.add_html(told_html(self._params))
        with self._gui.add_folder("Expert", expand_by_default=False):
            rest = [t for t in known.values() if t.name not in FIRST]
            for group in dict.fromkeys(t.group for t in rest):
                with self._gui.add_folder(group):
                    for t in rest:
                        if t.group == group:
                            self._add(t)
        with self._gui.add_folder("Back to the default"):
            self.back = self._gui.add_button_group("Reset", (NOTHING,))
        self._add_files()
        self._listen()

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        changed = snapshot.params != self._params
        self._params = snapshot.params
        counts = used(snapshot.params)
        for name, control in self.controls.items():
            if self._hands[name].free:
                value = getattr(snapshot.params, name)
                number = isinstance(value, float)
                assign(control, shown(value, _FACTS[name].unit) if number else value)
            if control.disabled == (name in counts):
                control.disabled = name not in counts
        if changed:
            self.told.content = told_html(snapshot.params)
            names = tuple(f"{_FACTS[n].label}" for n in changed_names(snapshot.params))
            self.back.options = (*names, ALL) if len(names) > 1 else names or (NOTHING,)

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

    def _add_files(self) -> None:
        if self._shelf is None:
            return
        with self._gui.add_folder("Files", expand_by_default=False):
            self.save = self._gui.add_button(
                "Save these settings", icon=viser.Icon.DEVICE_FLOPPY, color="gray",
                hint="a TOML file for flinch run --params FILE",
            )  # fmt: skip
            self.files = self._gui.add_dropdown("Saved", self._names())
            self.load = self._gui.add_button(
                "Load the one that is chosen", icon=viser.Icon.FOLDER_OPEN, color="gray"
            )

        # these wait for the disk: not on the thread of the sockets
        @self.save.on_click
        def _(_: Any) -> None:
            self._try(self._save)

        @self.load.on_click
        def _(_: Any) -> None:
            self._try(self._load)

    def _listen(self) -> None:
        @self.preset.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._engine.post(SetParams(preset_changes(event.target.value)))

        @self.back.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            names = changed_names(self._params)
            wanted = event.target.value
            some = [n for n in names if wanted == ALL or _FACTS[n].label == wanted]
            if some:
                self._engine.post(SetParams({n: _FACTS[n].default for n in some}))

    def _change(self, t: Tunable, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is None:  # the page itself showed what another window has set
            return
        self._hands[t.name].touch()
        value = event.target.value
        if t.kind is float:
            value = clamped(value / MM if t.unit == "m" else value, t)
        self._engine.post(SetParams({t.name: value}))

    def _names(self) -> tuple[str, ...]:
        names = self._shelf.names() if self._shelf is not None else ()
        return names or (NOTHING,)

    def _try(self, act: Any) -> None:
        try:
            act()
        except FlinchError as error:
            self._engine.post(Remark(str(error), refused=True))

    def _save(self) -> None:
        assert self._shelf is not None
        path = self._shelf.save("\n".join(toml(self._params)) + "\n")
        self.files.options = self._names()
        assign(self.files, path.name)
        self._engine.post(Remark(f"settings saved: flinch run --params {path}"))

    def _load(self) -> None:
        assert self._shelf is not None
        params = load_params(self._shelf.path(self.files.value))
        changes = {t.name: getattr(params, t.name) for t in tunables()}
        self._engine.post(SetParams(changes))


_FACTS = {t.name: t for t in tunables()}


def changed_names(params: Params) -> list[str]:
    """The settings that are not at their defaults, but for which controller leads."""
    facts = (t for t in tunables() if t.name not in ELSEWHERE)
    return [t.name for t in facts if getattr(params, t.name) != t.default]


def preset_changes(name: str) -> dict[str, Any]:
    """What a preset sets: all that any of them does, the rest of it at the default."""
    return {n: PRESETS[name].get(n, _FACTS[n].default) for n in OF_PRESETS}


def preset_of(params: Params) -> str:
    """The preset that the settings are at; empty for none."""
    for name in PRESETS:
        if all(getattr(params, n) == v for n, v in preset_changes(name).items()):
            return name
    return ""


def told_html(params: Params) -> str:
    """Which preset it is, how many settings are changed, and for whom grey ones do not count."""
    count = len(changed_names(params))
    words = f"{count} changed" if count else "All at their defaults"
    preset = preset_of(params)
    words += f", as {preset}" if preset and count else ""
    grey = f"Grey: not used by {kind_of(params.mode).label}"
    return (
        f'<div data-changed="{count}" style="padding:0 10px 0.5em;font-size:0.85em;height:2.9em;'
        f'overflow:hidden"><b>{words}</b><br>{escape(grey)}</div>'
    )


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
