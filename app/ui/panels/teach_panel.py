"""Waypoint programs: a way taught by bringing the arm to each place, and those that are there."""

import re
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import viser

from app.actions import Place, RunProgram, RunTaught, SetGoal, SetMode
from app.control.programs import program_text
from app.messages import Mode, Snapshot
from app.text_file import write_new
from app.ui.access import words
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.panels.assign import assign
from app.ui.panels.jog_pad import small_html

NONE = "(none)"
EARLIER, LATER, GO, DELETE = "Earlier", "Later", "Go to", "Delete"
START, END, RUN, SAVE = "Start", "End", "Run", "Save"
LONGEST_STAY, MOST = 600.0, 200  # [s], waypoints
FOLDER = Path("programs")  # where taught programs are saved, beside the recordings


@dataclass(frozen=True, slots=True)
class Taught:
    """Places in their order, and which of them is chosen; -1 of none."""

    places: tuple[Place, ...] = ()
    chosen: int = -1

    def added(self, place: Place) -> "Taught":
        """After the chosen one, and chosen itself."""
        at = self.chosen + 1
        return Taught((*self.places[:at], place, *self.places[at:]), at)

    def moved(self, by: int) -> "Taught":
        """The chosen one changed with its neighbour, if it has one there."""
        to = self.chosen + by
        if self.chosen < 0 or not 0 <= to < len(self.places):
            return self
        places = list(self.places)
        places[self.chosen], places[to] = places[to], places[self.chosen]
        return Taught(tuple(places), to)

    def deleted(self) -> "Taught":
        """Without the chosen one."""
        at = self.chosen
        if at < 0:
            return self
        left = (*self.places[:at], *self.places[at + 1 :])
        return Taught(left, min(at, len(left) - 1))

    def staying(self, seconds: float) -> "Taught":
        """The chosen one held so long."""
        if self.chosen < 0:
            return self
        places = list(self.places)
        places[self.chosen] = replace(places[self.chosen], dwell=seconds)
        return Taught(tuple(places), self.chosen)

    def lines(self) -> tuple[str, ...]:
        """One for each place, all different: its number, where it is and how long it is held."""
        return tuple(
            f"{k + 1}: {_mm(p)}" + (f", {p.dwell:g} s" if p.dwell else "")
            for k, p in enumerate(self.places)
        )


class TeachPanel:
    """Add here, reorder, dwell, delete, run and save; and the programs that are there already."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, folder: Path = FOLDER
    ) -> None:  # fmt: skip
        gui = server.gui
        self._engine, self._pace, self._folder = engine, Every(0.2), folder
        self._snapshot: Snapshot | None = None
        self._taught, self._said = Taught(), ""
        self.add = gui.add_button("Add where the tool is", icon=viser.Icon.MAP_PIN_PLUS)
        self.place = gui.add_dropdown("Waypoint", (NONE,))
        self.edit = gui.add_button_group("", (EARLIER, LATER, GO, DELETE))
        self.stay = gui.add_number("Stay [s]", 0.0, min=0.0, max=LONGEST_STAY, step=0.5)
        self.name = gui.add_text("Name", "taught", hint="of the file and in the list of programs")
        self.use = gui.add_button_group("", (RUN, SAVE))
        names = engine.programs or (NONE,)
        self.program = gui.add_dropdown("Program", names, hint="waypoints, one after another")
        self.buttons = gui.add_button_group("", (START, END))
        self.state = gui.add_html("")

        @self.add.on_click
        async def _(_: Any) -> None:
            if self._snapshot is not None and len(self._taught.places) < MOST:
                self._show(self._taught.added(Place(self._snapshot.T_base_tool)))

        @self.place.on_update
        async def _(event: Any) -> None:
            lines = self._taught.lines()
            if event.client_id is not None and event.target.value in lines:
                self._show(replace(self._taught, chosen=lines.index(event.target.value)))

        @self.stay.on_update
        async def _(event: Any) -> None:
            if event.client_id is not None:
                seconds = min(max(float(event.target.value), 0.0), LONGEST_STAY)
                self._show(self._taught.staying(seconds))

        self.edit.on_click(self._edit)
        self.use.on_click(self._use)

        @self.buttons.on_click
        async def _(event: Any) -> None:
            start = event.target.value == START and self.program.value != NONE
            engine.post(RunProgram(self.program.value if start else ""))

    def update(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        if self._pace.due(snapshot.stamp):
            self.state.content = small_html(snapshot.program or self._said or "no program runs")

    async def _edit(self, event: Any) -> None:
        match event.target.value:
            case "Earlier":
                self._show(self._taught.moved(-1))
            case "Later":
                self._show(self._taught.moved(1))
            case "Delete":
                self._show(self._taught.deleted())
            case _ if self._taught.chosen >= 0:
                self._engine.post(SetGoal(self._taught.places[self._taught.chosen].T_base_tool))
                self._set_out(event)

    async def _use(self, event: Any) -> None:
        name, places = slug(self.name.value), self._taught.places
        if not places:
            self._said = "no waypoint yet: bring the tool to a place, and add it"
        elif event.target.value == RUN:
            self._engine.post(RunTaught(name, places))
            self._set_out(event)
        else:
            self._save(name)

    def _save(self, name: str) -> None:
        try:
            path = write_new(self._folder, name, ".toml", program_text(name, self._taught.places))
        except OSError as e:
            self._said = f"{self._folder} cannot be written ({e.strerror}); start elsewhere"
        else:
            self._said = f"saved: flinch run --program {path}"

    def _set_out(self, event: Any) -> None:
        """An arm that holds begins to go; one that is stopped stays so until Run is pressed."""
        if self._snapshot is not None and self._snapshot.status.mode is Mode.HOLDING:
            reason = f"sent by a person at {words(event.client_id)}"
            self._engine.post(SetMode(Mode.RUNNING, reason))

    def _show(self, taught: Taught) -> None:
        self._taught = taught
        lines = taught.lines()
        self.place.options = lines or (NONE,)
        if lines:
            assign(self.place, lines[taught.chosen])
            assign(self.stay, taught.places[taught.chosen].dwell)


def slug(name: str) -> str:
    """A name that is safe as a file's: letters, digits and dashes."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40] or "taught"


def _mm(place: Place) -> str:
    x, y, z = np.round(1000.0 * place.T_base_tool[:3, 3]) + 0.0
    return escape(f"{x:.0f} {y:.0f} {z:.0f} mm")
