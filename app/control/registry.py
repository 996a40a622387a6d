"""The controllers there are, by name: one decorator makes one known everywhere.

    @controller("mine", label="Mine", help="what it does, in one line", needs=links)
    class Mine: ...

The command line, the page, the plots, the studies, the ghost and the rehearsal read what is
registered here; none of them knows a controller by name. The class (or any function) is called
with the robot and the clearance, which knows the cell, and returns a `Controller`. A file in
`app/control/modes` is found by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from app.config import MODES, Params
from app.errors import ConfigError
from app.needs import Needs

if TYPE_CHECKING:  # see `app.control.modes`
    from app.control.clearance import Clearance
    from app.control.controller import Controller
    from app.robot.model import Robot

M = TypeVar("M", bound=Callable[..., Any])
# [m] Task priority fades in over FADES and comes to rest about half way in. The paper gives no
# widths; its mean distance of 0.28 to 0.30 m fits a transition that begins at 0.30 m.
FADES, CLOSER, LEAST = 0.10, 0.05, 0.05


def fading_distances(params: Params) -> tuple[float, float]:
    """[m] where task priority acts fully, and from where on it acts at all."""
    full = max(params.distance_kept - CLOSER, LEAST)
    return full, full + FADES


def links(params: Params) -> Needs:
    """The closest pair of every link, as far as task priority acts."""
    return Needs("links", fading_distances(params)[1])


# what every controller uses, beside what it is told by its needs: motion, and what it is kept to
EVERYONES = frozenset(
    {"mode", "goal_speed", "goal_turning", "joint_speed", "way_round", "solver", "reaction_time",
     "braking", "memory", "obstacle_speed", "silence"}
)  # fmt: skip
BEYOND_THE_PAPER = frozenset({"memory", "obstacle_speed"})  # not done where perceived as published
OF_SEPARATION = frozenset({"person_speed", "person_speed_measured", "separation_margin"})


@dataclass(frozen=True)
class Kind:
    """What is known of a controller without making one.

    label:      its name on the page.   help: one line.
    needs:      what it wants of perception.
    distances:  [m] that it keeps, and from which on it acts; None where there is no such distance.
    knows_cell: it bounds itself by the known cell; any other one's velocity is kept out of it.
    memory:     the settings of `memory` that it is compared with; first the one it is meant for.
    studies:    names of the experiments that it takes part in.
    uses:       settings that it uses beside `EVERYONES`; None: not told, any may count.
    """

    name: str
    label: str
    help: str
    make: Callable[[Robot, Clearance], Controller]
    needs: Callable[[Params], Needs] = links
    distances: Callable[[Params], tuple[float, float] | None] = fading_distances
    knows_cell: bool = False
    memory: tuple[bool, ...] = (True,)
    studies: frozenset[str] = frozenset({"tradeoff", "worlds"})
    uses: frozenset[str] | None = None


_KINDS: dict[str, Kind] = {}


def kinds() -> Mapping[str, Kind]:
    """All that are registered, those shipped first."""
    import_module("app.control.modes")
    return _KINDS


def controller(name: str, label: str, help: str, **facts: Any) -> Callable[[M], M]:
    """Register what follows as the maker of a controller; `facts` are those of `Kind`."""

    def register(make: M) -> M:
        if name in kinds():
            raise ValueError(f"two controllers are called {name!r}; give one another name")
        _KINDS[name] = Kind(name, label, help, make, **facts)
        MODES[name] = help
        return make

    return register


def kind_of(name: str, what: str = "mode") -> Kind:
    """The controller of this name; ConfigError for one that nobody has registered."""
    if name not in kinds():
        raise ConfigError(f"{what} = {name!r}; choose one of {', '.join(kinds())}")
    return _KINDS[name]


def used(params: Params) -> frozenset[str]:
    """The settings that count for the controller in force as it is set now."""
    kind = kind_of(params.mode)
    if kind.uses is None:
        return frozenset(f.name for f in fields(Params))
    names = EVERYONES | kind.uses
    if kind.needs(params).as_published:
        names -= BEYOND_THE_PAPER
    if "separation" in names and not params.separation:
        names -= OF_SEPARATION
    return names


def forget(name: str) -> None:
    """The controller of this name is no longer there."""
    del _KINDS[name], MODES[name]


def taking_part(study: str) -> tuple[Kind, ...]:
    """The controllers that an experiment compares, in their order."""
    return tuple(k for k in kinds().values() if study in k.studies)
