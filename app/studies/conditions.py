"""Conditions: which controller, on which side, with what changed; by a name that can be typed.

    WB  WBL  QPR-memory  QPL+dead:3  oracleL  QP alone  QPL+set:distance_kept=0.2

A controller, a side where the experiment has sides, then what is left out (-) or added (+), and
the variant where the experiment has variants, as in QP-memory@1.0.
Others' controllers are named by their files: mine.py, mine.py:MineL+dead:3.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.config import Params, change, tunables
from app.control.guests.files import GUEST, welcome
from app.control.registry import kind_of, kinds
from app.errors import ConfigError, options
from app.sensing.budget import read_budget
from app.studies.faulty_skin import KINDS

ORACLE = "oracle"  # the default controller that perceives the truth
SHORT = {"S": "sm", "WB": "wb", "QP": "qp"}  # the paper's names, and ours
SIDES = {"R": "right", "L": "left"}
ALONE = " alone"
AT = "@"  # before a variant
HAND = "hand"  # that lies on windows from the start: what is added like a fault, and is none
CALIBRATED = "mounting=0.35"  # of 2 mm and 0.5 degrees: what a calibration leaves
# what its sensors say is nothing to the oracle, as long as they speak; the arm stays as it is
TOLD = "ideal,encoders=1,kinematics=1,body=1,mounting=1"
LEFT_OUT = {"memory": {"memory": False}, "speed": {"obstacle_speed": False}}
PAIRS = "pairs"  # left out: all but the closest pair of each link
ADDED = ("program:NAME", "calibrated", "set:NAME=VALUE", "skin:LAYOUT", "world:PART=STRENGTH")


@dataclass(frozen=True)
class Condition:
    """A condition, taken apart.

    mode:  the controller's name.   side: 'right', 'left' or '' where there is none.
    alone: nobody is there: what the others are compared with.
    oracle: the truth is perceived.
    changes: settings by name.   world: parts of the error budget, added to the trial's.
    fault, failing: kind of fault (`app.studies.faulty_skin`) or `HAND`, and of how many sensors.
    one_pair: of each link the closest pair only, instead of several.
    skin: another layout.   program: another one than the experiment's.
    variant: of the experiment, '' where it has none.
    """

    name: str
    mode: str
    side: str = ""
    alone: bool = False
    oracle: bool = False
    changes: tuple[tuple[str, Any], ...] = ()
    world: tuple[str, ...] = ()
    fault: str = ""
    failing: int = 0
    skin: str = ""
    program: str = ""
    variant: str = ""
    one_pair: bool = False

    def params(self) -> Params:
        """Each controller as it is meant to be run: the paper's have no memory; then changed."""
        usual = Params(mode=self.mode, memory=kind_of(self.mode).memory[0])
        return change(usual, dict(self.changes))

    def budget(self, world: str) -> str:
        """The error budget of a trial in `world`."""
        if self.oracle and world.partition(",")[0] != "ideal":
            world = TOLD
        return ",".join((world, *self.world))


def read_condition(
    text: str, sides: bool = True, variants: Sequence[str] = (),
    other: Callable[[str], object] | None = None,
) -> Condition:  # fmt: skip
    """The condition of a name; ConfigError for one that there is not.

    sides: does the experiment have a left and a right?   variants: those that it has.
    other: raises ConfigError for a variant that is none; None: there are no other ones.
    """
    plain, _, variant = text.partition(AT)
    if variant not in variants:
        _check_variant(text, variant, variants, other)
    plain, alone = plain.removesuffix(ALONE), plain.endswith(ALONE)
    name, *changes = words_of(plain)
    who, side = _controller(name, text, sides and not alone)
    oracle = name.startswith(ORACLE)
    condition = Condition(text, who, side, alone, oracle, variant=variant)
    for word in changes:
        condition = _changed(condition, word)
    params = condition.params()
    read_budget(condition.budget("honest"))
    if condition.one_pair and (oracle or kind_of(who).needs(params).pairs != "several"):
        raise ConfigError(
            f"condition {text!r}: it has no several pairs to leave out; use QP-{PAIRS}"
        )
    return condition


def words_of(plain: str) -> list[str]:
    """A controller with its side, then each change.

    A file's name may hold signs itself. After a colon a - belongs to the value, such as a layout's
    name, so that what is left out comes before what is added.
    """
    guest = re.fullmatch(rf"({GUEST}[A-Z]?)([+-].*)?", plain)
    name, changes = (guest[1], guest[2] or "") if guest else ("", plain)
    words = [name] if guest else []
    for piece in filter(None, re.split(r"(?=[+-])", changes)):
        if piece.startswith("-") and len(words) > 1 and ":" in words[-1]:
            words[-1] += piece
        else:
            words.append(piece)
    return words


def short(mode: str) -> str:
    """What conditions call a controller."""
    return next((name for name, of in SHORT.items() if of == mode), mode)


def _check_variant(
    text: str, variant: str, variants: Sequence[str], other: Callable[[str], object] | None
) -> None:
    """ConfigError for a variant that is not among the named ones, unless `other` knows it."""
    if other is not None and variant:
        other(variant)
    elif variants:
        known = options(variant, variants)
        raise ConfigError(f"no condition {text!r}; after the controller give {AT}VARIANT; {known}")
    elif variant:
        raise ConfigError(f"no condition {text!r}: the experiment has no variants; leave {AT} out")


def _controller(name: str, text: str, sides: bool) -> tuple[str, str]:
    if re.fullmatch(GUEST + "[A-Z]?", name):
        if not sides:
            return welcome(name), ""
        if name[-1] not in SIDES:
            raise ConfigError(f"no condition {text!r}; end its controller with R or L")
        return welcome(name[:-1]), SIDES[name[-1]]
    known = {**{n: n for n in kinds()}, **SHORT, ORACLE: Params().mode}
    for hidden in SHORT.values():
        known.pop(hidden, None)  # one name each
    if sides:
        known_sides = {
            n + s: (mode, side) for n, mode in known.items() for s, side in SIDES.items()
        }
    else:
        known_sides = {n: (mode, "") for n, mode in known.items()}
    if name not in known_sides:
        raise ConfigError(f"no condition {text!r}; {options(name, known_sides)}")
    return known_sides[name]


def _changed(c: Condition, word: str) -> Condition:
    """`c` with what one word leaves out or adds."""
    sign, (what, _, value) = word[0], word[1:].partition(":")
    if sign == "-" and what in LEFT_OUT:
        return replace(c, changes=(*c.changes, *LEFT_OUT[what].items()))
    if word == f"-{PAIRS}":
        return replace(c, one_pair=True)
    if sign == "-":
        known = options(what, (*LEFT_OUT, PAIRS))
        raise ConfigError(f"condition {c.name!r}: nothing to leave out; {known}")
    if what == "calibrated" and not value:
        return replace(c, world=(*c.world, CALIBRATED))
    if what == "set":
        key, _, given = value.partition("=")
        return replace(c, changes=(*c.changes, (key, _setting(key, given))))
    if what == "program" and value:
        return replace(c, program=value)
    if what == "skin" and value:
        return replace(c, skin=value)
    if what == "world" and value:
        return replace(c, world=(*c.world, value))
    if what in (*KINDS, HAND) and value.isdecimal() and int(value) > 0:
        return replace(c, fault=what, failing=int(value))
    added = [*ADDED, *(f"{kind}:SENSORS" for kind in (*KINDS, HAND))]
    raise ConfigError(f"condition {c.name!r}: {word!r}; {options(what, added)}")


def _setting(key: str, text: str) -> Any:
    """The value of a setting from its text; what is wrong with it is said by `change`."""
    kind = next((t.kind for t in tunables() if t.name == key), str)
    if kind is bool:
        return {"true": True, "false": False}.get(text, text)
    try:
        return float(text) if kind is float else text
    except ValueError:
        return text
