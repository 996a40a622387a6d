"""Every setting once.

Each field of `Params` carries its unit, its range and a sentence that a person understands. From
this one place come the command-line flag, the key and the check of a TOML file, the control on the
page and the table in the manual, all by the same words: `distance_kept` is "Distance kept" on the
page and `--distance-kept` for the command line. `Params` is frozen and swapped whole:
`replace(params, distance_kept=0.3)`.

What is not here is a constant beside the code that uses it, with its reason, or a fact of a sensor
in its type (`app.robot.sensor_type`).
"""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from app.config_names import moved
from app.errors import ConfigError, options
from app.text_file import as_text, read_file

# What may be chosen, each with its line of help. Rooms look down: a room above that holds what is
# chosen from writes its names here.
MODES: dict[str, str] = {}  # by `app.control.registry`
SOLVERS = {"daqp": "an active-set method, exact", "proxqp": "an augmented Lagrangian method"}

CLEARANCE, GOAL, SEPARATION, SENSES = "Keeping clear", "The goal", "Separation", "What is seen"


def number(default: float, unit: str, low: float, high: float, group: str, help: str) -> Any:
    """A setting from `low` to `high` [unit]."""
    return _setting(default, unit, low, high, group, help, None)


def switch(default: bool, group: str, help: str) -> Any:
    """A setting that is on or off."""
    return _setting(default, "", None, None, group, help, None)


def choice(default: str, group: str, help: str, choices: Mapping[str, str]) -> Any:
    """A setting that is one of `choices`, each with its line of help."""
    return _setting(default, "", None, None, group, help, choices)


def _setting(
    default: Any, unit: str, low: float | None, high: float | None, group: str, help: str,
    choices: Mapping[str, str] | None,
) -> Any:  # fmt: skip
    facts = {"unit": unit, "low": low, "high": high, "group": group, "help": help}
    return field(default=default, metadata=facts | {"choices": choices})


@dataclass(frozen=True)
class Params:
    """All settings that may change while running (SI units).

    Defaults: the paper gives no values. The distances fit its mean distance of 0.28 to 0.30 m; the
    speeds are slow enough to watch beside an arm.
    """

    mode: str = choice("qp", CLEARANCE, "which controller leads the arm", MODES)
    distance_kept: float = number(
        0.25, "m", 0.05, 0.40, CLEARANCE,
        "how far the arm stays from what its sensors see; more is safer and reaches less",
    )  # fmt: skip
    avoidance_begins: float = number(
        0.60, "m", 0.42, 1.50, CLEARANCE, "what is farther away does not slow the arm (qp)"
    )
    retreat_speed: float = number(
        0.5, "m/s", 0.05, 1.5, CLEARANCE,
        "how fast the arm gives way at most to what is too near (qp)",
    )  # fmt: skip
    slide_along: bool = switch(
        False, CLEARANCE,
        "slide along what blocks the way to the goal, instead of slowing before it (qp)",
    )  # fmt: skip
    way_round: bool = switch(
        False, CLEARANCE,
        "when the goal is blocked, try a way round it: a few seconds and at most 0.3 m aside",
    )  # fmt: skip
    bounds_first: bool = switch(
        False, CLEARANCE,
        "where not all can be kept clear of, the least is given up first, whatever the goal (qp)",
    )  # fmt: skip
    limits_first: bool = switch(
        False, CLEARANCE,
        "leave the ends of the joints' ranges before anything else (wb, sm, multi)",
    )  # fmt: skip
    solver: str = choice(
        "daqp", CLEARANCE,
        "solver of the quadratic programmes; the other one gives the second opinion", SOLVERS,
    )  # fmt: skip
    goal_speed: float = number(
        0.30, "m/s", 0.02, 1.0, GOAL, "how fast the tool goes to its goal at most"
    )
    goal_turning: float = number(
        0.6, "rad/s", 0.05, 2.0, GOAL, "how fast the tool turns to its goal at most"
    )
    joint_speed: float = number(
        0.5, "", 0.05, 1.0, GOAL, "share of the joints' own speed limits that may be used"
    )
    position_first: bool = switch(
        False, GOAL, "the goal's place before its orientation (wb, sm, multi)"
    )
    separation: bool = switch(
        False, SEPARATION,
        "also bound the approach by speed and separation; a model, not a certified function (qp)",
    )  # fmt: skip
    person_speed: float = number(
        1.6, "m/s", 0.0, 3.0, SEPARATION, "how fast a person is assumed to come"
    )
    person_speed_measured: bool = switch(
        False, SEPARATION, "a person comes as fast as is measured, with a margin, not as is assumed"
    )
    reaction_time: float = number(
        0.17, "s", 0.02, 1.0, SEPARATION,
        "from a measurement to the first braking; an older measurement adds to it",
    )  # fmt: skip
    braking: float = number(
        3.0, "m/s^2", 0.5, 10.0, SEPARATION, "how hard a point of the body can brake"
    )
    separation_margin: float = number(
        0.10, "m", 0.0, 1.0, SEPARATION, "room for what is not known of positions"
    )
    memory: bool = switch(True, SENSES, "remember for a while what has left the field of view")
    obstacle_speed: bool = switch(
        True, SENSES, "measure how fast things come nearer, and give way the faster"
    )
    silence: float = number(
        0.5, "s", 0.1, 2.0, SENSES,
        "the arm stops when half of the sensors have not spoken for this long, and slows before",
    )  # fmt: skip

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            _check(f.name, value, "")
            if _FACTS[f.name].kind is float:
                # a whole number from a file or a slider; kernels tell 10 from 10.0
                object.__setattr__(self, f.name, float(value))


class Tunable(NamedTuple):
    """The facts of one field of `Params`; `known` are the choices that there are now."""

    name: str
    kind: type
    known: Mapping[str, str] | None
    default: Any
    unit: str
    low: float | None
    high: float | None
    group: str
    about: str

    @property
    def label(self) -> str:
        """What the page calls it: its name in words."""
        return self.name.replace("_", " ").capitalize()

    @property
    def choices(self) -> tuple[str, ...]:
        """Names of what it may be; empty where it is a number or a switch."""
        return tuple(self.known or ())

    @property
    def help(self) -> str:
        """One line, with what each choice is."""
        if self.known is None:
            return self.about
        return f"{self.about}: " + "; ".join(f"{k} = {v}" for k, v in self.known.items())


def tunables() -> Iterator[Tunable]:
    """The facts of every field of `Params`, in their order."""
    hints = get_type_hints(Params)
    for f in fields(Params):
        m = f.metadata
        yield Tunable(
            f.name, hints[f.name], m["choices"], f.default, m["unit"], m["low"], m["high"],
            m["group"], m["help"],
        )  # fmt: skip


def change(params: Params, changes: Mapping[str, Any]) -> Params:
    """`params` with some settings changed; an unknown name or a bad value is a ConfigError."""
    for key in changes:
        _check_name(key, "")
    return replace(params, **changes)


def load_params(path: Path, base: Params | None = None) -> Params:
    """`base` with the values of a flat TOML file; an unknown key or a bad value is named."""
    content = read_file(path, ConfigError)
    try:
        table = tomllib.loads(as_text(path, content, ConfigError))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise ConfigError(f"{path}: not valid TOML ({e}); mend that line") from e
    for key, value in table.items():
        _check_name(key, f"{path}: ")
        _check(key, value, f"{path}: ")
    return replace(base or Params(), **table)


def _check_name(name: str, where: str) -> None:
    if name not in _FACTS:
        remedy = moved(name) or options(name, _FACTS)
        raise ConfigError(f"{where}unknown setting {name!r}; {remedy}")


def _check(name: str, value: Any, where: str) -> None:
    t = _FACTS[name]
    if t.known is not None:
        # a process that has imported no room above knows no names yet, and drives nothing
        if t.known and value != t.default and value not in t.choices:
            raise ConfigError(f"{where}{name} = {value!r}; choose one of {', '.join(t.choices)}")
    elif t.kind is bool:
        if not isinstance(value, bool):
            raise ConfigError(f"{where}{name} = {value!r}; give true or false")
    elif isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{where}{name} = {value!r}; give a number in {t.unit or 'plain units'}")
    elif not (t.low <= value <= t.high):  # type: ignore[operator]  # numbers always have a range
        raise ConfigError(
            f"{where}{name} = {value:g} {t.unit}".rstrip()
            + f"; give a value from {t.low:g} to {t.high:g}"
        )


_FACTS = {t.name: t for t in tunables()}
