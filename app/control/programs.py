"""Waypoint programs: where the tool goes one after another, how near, and how long it stays.

The goal runs ahead of the tool on the straight line to the next waypoint and waits when the
tool falls behind: an arm that had to give way comes back to the line where it left it.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from app.actions import Place
from app.assets import asset_folder, find_asset
from app.control.goals import goal_error
from app.control.path import StraightPath, straight_path
from app.errors import ConfigError
from app.messages import Array, Goal, freeze
from app.poses import pose, turns
from app.robot.posture import rigid
from app.toml import Name, NotNegative, Positive, Table, Vector, read_toml

LEASH = 0.15  # [m] the goal stands still when the tool is this far behind
LEASH_TURN = 0.5  # [rad]


class WaypointTable(Table, frozen=True):
    """One `[[waypoint]]`; metres, degrees (roll, pitch, yaw about fixed axes), seconds."""

    name: Name
    position_m: Vector
    rpy_deg: Vector
    dwell_s: NotNegative = 0.0


class ProgramTable(Table, frozen=True):
    """A program's file."""

    title: str
    waypoint: Annotated[list[WaypointTable], Meta(min_length=1)]
    reach_m: Positive = 0.02
    reach_deg: Positive = 6.0
    speed_mps: Positive = 0.2
    turn_dps: Positive = 40.0
    loop: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Waypoint:
    """Where the tool goes (4, 4) and how long it stays [s]."""

    name: str
    T_base_tool: Array
    dwell: float


@dataclass(frozen=True, eq=False, slots=True)
class Program:
    """Waypoints in order; a waypoint is reached within `reach` [m] and `reach_turn` [rad]."""

    name: str
    title: str
    waypoints: tuple[Waypoint, ...]
    reach: float
    reach_turn: float
    speed: float
    turn_speed: float
    loop: bool


def find_program(name_or_path: str) -> Path:
    """The file of a shipped program's name, or of a path to a `.toml`."""
    folder = asset_folder("static_assets") / "programs"
    return find_asset(name_or_path, folder, ".toml", ConfigError)


def shipped_programs() -> dict[str, Program]:
    """All programs of the installation by name."""
    files = sorted((asset_folder("static_assets") / "programs").glob("*.toml"))
    return {f.stem: load_program(f) for f in files}


def load_program(path: Path) -> Program:
    """Read a program; a ConfigError names the file, the key and the remedy."""
    return _program(path.stem, read_toml(path, ProgramTable, ConfigError))


def taught(name: str, places: Sequence[Place]) -> Program:
    """A program of places that a person has taught; ValueError where one of them is no pose."""
    if not places or not all(0.0 <= p.dwell < 1e6 for p in places):
        raise ValueError("a taught program needs a place, and each is held for a time from 0 on")
    points = [
        Waypoint(str(k + 1), freeze(rigid(p.T_base_tool)), p.dwell) for k, p in enumerate(places)
    ]
    return replace(_program(name, _taught(name, places)), waypoints=tuple(points))


def program_text(name: str, places: Sequence[Place]) -> str:
    """The TOML of a taught program, as `load_program` reads it, with the values of all settings."""
    t = _taught(name, places)
    head = [f"{k} = {json.dumps(getattr(t, k))}" for k in t.__struct_fields__ if k != "waypoint"]
    tables = (
        "\n".join(
            ["[[waypoint]]", *(f"{k} = {json.dumps(getattr(w, k))}" for k in w.__struct_fields__)]
        )
        for w in t.waypoint
    )
    return "\n\n".join(("\n".join(head), *tables)) + "\n"


def _taught(name: str, places: Sequence[Place]) -> ProgramTable:
    points = []
    for k, p in enumerate(places):
        x, y, z = (round(float(v), 6) for v in p.T_base_tool[:3, 3])
        roll, pitch, yaw = (round(float(v), 4) for v in np.degrees(turns(p.T_base_tool)))
        points.append(WaypointTable(str(k + 1), (x, y, z), (roll, pitch, yaw), float(p.dwell)))
    return ProgramTable(f"{name}, taught on the page", points)


def _program(name: str, t: ProgramTable) -> Program:
    points = tuple(Waypoint(w.name, pose(w.position_m, w.rpy_deg), w.dwell_s) for w in t.waypoint)
    return Program(
        name, t.title, points, t.reach_m, float(np.radians(t.reach_deg)),
        t.speed_mps, float(np.radians(t.turn_dps)), t.loop,
    )  # fmt: skip


class ProgramRun:
    """A program on its way; `update` once a tick."""

    def __init__(self, program: Program, T_base_tool: Array) -> None:
        self.program = program
        self.reached = 0
        self.done = False
        self._index = 0
        self._stay = 0.0
        self._share = 0.0
        self._set_out(T_base_tool)

    @property
    def words(self) -> str:
        """Where it stands, for a person."""
        n = len(self.program.waypoints)
        name = self.program.waypoints[self._index].name
        return f"{self.program.name} {self._index + 1}/{n} {name}, {self.reached} reached"

    def update(self, T_base_tool: Array, dt: float) -> Goal:
        """The goal for the next `dt` [s], given where the tool is."""
        p, to = self.program, self.program.waypoints[self._index]
        if self._share < 1.0:
            behind, turn = goal_error(T_base_tool, self._path.pose(self._share))
            pace = max(0.0, 1.0 - max(behind / LEASH, turn / LEASH_TURN))
            step = dt / self._path.duration if self._path.duration > 0.0 else 1.0
            self._share = min(1.0, self._share + pace * step)
            return Goal(self._path.pose(self._share))
        error, angle = goal_error(T_base_tool, to.T_base_tool)
        # who is pushed away holds the place no longer, and begins anew when it is back
        there = error <= p.reach and angle <= p.reach_turn
        self._stay = self._stay + dt if there else 0.0
        if self._stay > to.dwell and not self.done:
            self.reached += 1
            self._next()
        return Goal(to.T_base_tool)

    def _next(self) -> None:
        here = self.program.waypoints[self._index].T_base_tool
        last = self._index + 1 == len(self.program.waypoints)
        if last and not self.program.loop:
            self.done = True
            return
        self._index = (self._index + 1) % len(self.program.waypoints)
        self._set_out(here)

    def _set_out(self, T: Array) -> None:
        p, to = self.program, self.program.waypoints[self._index]
        self._path: StraightPath = straight_path(T, to.T_base_tool, p.speed, p.turn_speed)
        self._share, self._stay = 0.0, 0.0
