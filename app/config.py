"""Every tunable once.

Each field of `Params` carries its unit, its range and one line of help. From this one place
come the command-line flag, the check of a TOML file, the slider on the page and the table in
the manual. `Params` is frozen and swapped whole: `replace(params, d_min=0.25)`.
"""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from app.errors import ConfigError, options

# What may be chosen, each with its line of help. Rooms look down: a room above that holds what is
# chosen from writes its names here.
MODES: dict[str, str] = {}  # by `app.control.registry`
SOLVERS = {"daqp": "an active-set method, exact", "proxqp": "an augmented Lagrangian method"}


def tunable(
    default: Any,
    unit: str,
    low: float | None,
    high: float | None,
    room: str,
    help: str,
    choices: Mapping[str, str] | None = None,
) -> Any:
    """A dataclass field with the facts that the page, the flags and the checks need."""
    facts = {"unit": unit, "low": low, "high": high, "room": room, "help": help, "choices": choices}
    return field(default=default, metadata=facts)


@dataclass(frozen=True)
class Params:
    """All settings that may change while running (SI units).

    Defaults and ranges: `d_min`, `delta` and the gains follow the reproduction of the paper,
    which gives no values; the filter's threshold follows the sensor's noise.
    """

    mode: str = tunable("qp", "", None, None, "control", "controller", MODES)
    d_min: float = tunable(
        0.20, "m", 0.05, 0.40, "control",
        "wb, sm, multi: distance at which avoidance is fully active",
    )  # fmt: skip
    delta: float = tunable(
        0.10, "m", 0.05, 0.30, "control", "wb, sm, multi: width of the transition above d_min"
    )
    lambda_safety: float = tunable(
        2.0, "1/s", 0.5, 5.0, "control", "wb, sm, multi: gain of the avoidance task"
    )
    v_safe: float = tunable(
        0.6, "m/s", 0.05, 1.0, "control", "wb, sm, multi: largest speed of the avoidance task"
    )
    lambda_p: float = tunable(1.2, "1/s", 0.1, 5.0, "control", "gain of the goal position")
    lambda_o: float = tunable(1.5, "1/s", 0.1, 5.0, "control", "gain of the goal orientation")
    v_max: float = tunable(0.30, "m/s", 0.02, 1.0, "control", "largest speed towards the goal")
    w_max: float = tunable(0.6, "rad/s", 0.05, 2.0, "control", "largest turn towards the goal")
    speed: float = tunable(
        0.5, "", 0.05, 1.0, "control", "share of the joints' velocity limits that may be used"
    )
    eps_min: float = tunable(
        0.03, "m", 0.005, 0.20, "perception", "self filter: smallest threshold before the body"
    )
    eps_base: float = tunable(
        0.02, "m", 0.0, 0.20, "perception", "self filter: threshold = base + sigmas x noise"
    )
    eps_sigmas: float = tunable(
        3.0, "", 0.0, 10.0, "perception", "self filter: multiples of the range noise"
    )
    footprint: bool = tunable(
        True, "", None, None, "perception",
        "self filter: up to nine rays a zone, since a zone is a cone",
    )  # fmt: skip
    two_sided: bool = tunable(
        False, "", None, None, "perception",
        "self filter: keep points behind the body, as the paper's Algorithm 1 does",
    )  # fmt: skip
    near_cut: float = tunable(
        0.015, "m", 0.0, 0.10, "perception", "self filter: rays start this far from the lens"
    )
    range_min: float = tunable(0.02, "m", 0.0, 0.5, "perception", "shorter ranges are out of range")
    range_max: float = tunable(4.0, "m", 0.2, 4.0, "perception", "longer ranges are out of range")
    frame_age: float = tunable(
        0.20, "s", 0.05, 1.0, "perception", "older frames are stale and leave the cloud"
    )
    accept_unconfirmed: bool = tunable(
        False, "", None, None, "perception",
        "also trust target statuses 6 and 10 (no previous target to compare with)",
    )  # fmt: skip
    accept_merged: bool = tunable(
        True, "", None, None, "perception",
        "trust target status 9 (two surfaces merged into one pulse)",
    )  # fmt: skip
    ghost_filter: bool = tunable(
        True, "", None, None, "perception",
        "wait for a second frame or zone before a nearer point is believed",
    )  # fmt: skip
    ghost_near: float = tunable(
        0.15, "m", 0.0, 0.5, "perception",
        "points nearer than this to the lens or before the body are believed at once",
    )  # fmt: skip
    memory: bool = tunable(
        True, "", None, None, "perception",
        "keep points that have left the field of view for a while",
    )  # fmt: skip
    obstacle_speed: bool = tunable(
        True, "", None, None, "perception",
        "estimate how fast obstacles approach and give way the faster",
    )  # fmt: skip
    silence: float = tunable(
        0.5, "s", 0.1, 2.0, "runtime", "the arm stops when no sensor has spoken for this long"
    )

    d_s: float = tunable(
        0.25, "m", 0.05, 0.40, "control", "qp: distance that is kept; safety against reach"
    )
    d_inf: float = tunable(0.60, "m", 0.42, 1.50, "control", "qp: farther pairs are no bounds")
    xi: float = tunable(1.0, "m/s", 0.1, 3.0, "control", "qp: approach speed that is free at d_inf")
    v_esc: float = tunable(
        0.5, "m/s", 0.05, 1.5, "control", "qp: largest speed of retreat that a pair demands"
    )
    k_g: float = tunable(10.0, "", 0.1, 100.0, "control", "qp: weight of the goal's twist")
    k_b: float = tunable(
        0.5, "", 0.0, 10.0, "control", "qp: weight of progress along the goal's twist"
    )
    solver: str = tunable(
        "daqp", "", None, None, "control",
        "solver of the quadratic programmes; the other one gives the second opinion", SOLVERS,
    )  # fmt: skip
    slide: bool = tunable(
        False, "", None, None, "control",
        "qp: slide along an obstacle that blocks the goal, instead of slowing before it",
    )  # fmt: skip
    lexicographic: bool = tunable(
        False, "", None, None, "control",
        "qp: first the least relaxing of the bounds, whatever it costs the goal",
    )  # fmt: skip
    limit_task: bool = tunable(
        False, "", None, None, "control",
        "wb, sm, multi: leave the ends of the joints' ranges before anything else",
    )  # fmt: skip
    goal_split: bool = tunable(
        False, "", None, None, "control",
        "wb, sm, multi: the goal's position before its orientation",
    )  # fmt: skip
    separation: bool = tunable(
        False, "", None, None, "control",
        "qp: also bound the approach by speed and separation; a model, not a certified function",
    )  # fmt: skip
    ssm_person: float = tunable(
        1.6, "m/s", 0.0, 3.0, "control", "separation: speed that a person is assumed to come with"
    )
    ssm_measured: bool = tunable(
        False, "", None, None, "control",
        "separation: the person comes as fast as is measured, with a margin, not as is assumed",
    )  # fmt: skip
    ssm_reaction: float = tunable(
        0.17, "s", 0.02, 1.0, "control",
        "separation: from a measurement to the first braking; an older measurement adds to it",
    )  # fmt: skip
    ssm_deceleration: float = tunable(
        3.0, "m/s^2", 0.5, 10.0, "control", "separation: braking of a body point"
    )
    ssm_margin: float = tunable(
        0.10, "m", 0.0, 1.0, "control", "separation: intrusion and uncertainty of positions"
    )
    escape: bool = tunable(
        False, "", None, None, "control",
        "try a way round, a few seconds and at most 0.3 m aside, when the goal is blocked",
    )  # fmt: skip
    slow_after: float = tunable(
        0.2, "s", 0.1, 2.0, "runtime", "the arm slows when no sensor has spoken for this long"
    )

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
    room: str
    about: str

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
            m["room"], m["help"],
        )  # fmt: skip


def change(params: Params, changes: Mapping[str, Any]) -> Params:
    """`params` with some settings changed; an unknown name or a bad value is a ConfigError."""
    for key in changes:
        if key not in _FACTS:
            raise ConfigError(f"unknown setting {key!r}; {options(key, _FACTS)}")
    return replace(params, **changes)


def load_params(path: Path, base: Params | None = None) -> Params:
    """`base` with the values of a flat TOML file; an unknown key or a bad value is named."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise ConfigError(f"{path}: cannot be read ({e.strerror}); give another file") from e
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise ConfigError(f"{path}: not valid TOML ({e}); mend that line") from e
    known = {t.name for t in tunables()}
    for key, value in table.items():
        if key not in known:
            raise ConfigError(f"{path}: unknown setting {key!r}; {options(key, known)}")
        _check(key, value, f"{path}: ")
    return replace(base or Params(), **table)


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
