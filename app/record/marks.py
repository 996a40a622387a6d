"""What a person looks for in a long run: stops, switches, touches, and what people asked for."""

from dataclasses import dataclass
from typing import Any

from app.actions import Action, Remark, SetMode, SetParams
from app.messages import Mode, Verdict
from app.tick import Inputs, Outputs

CONTACT = int(Verdict.CONTACT)  # numpy is slow with an enum
SAME = 0.5  # [s] the same action again within this is one: a goal is dragged
LONGEST = 60  # letters of what a person asked for


@dataclass(frozen=True, slots=True)
class Mark:
    """tick: its number, as `Inputs.tick`.   kind: 'stop', 'mode', 'controller', 'touch' or
    'action'.   words: for a person."""

    tick: int
    kind: str
    words: str


class Marker:
    """Sees every tick and finds its marks."""

    def __init__(self) -> None:
        self._mode: Mode | None = None
        self._controller = ""
        self._touch = False
        self._asked: dict[str, float] = {}  # [s] when each kind of action was last asked for

    def marks(self, x: Inputs, out: Outputs) -> list[Mark]:
        """Those of this tick; the first tick has none but for actions."""
        found = [Mark(x.tick, "action", words) for a in x.actions if (words := self._new(a, x.now))]
        mode, controller = out.status.mode, out.params.mode
        if self._mode not in (None, mode):
            kind = "stop" if mode is Mode.STOPPED else "mode"
            reason = f": {out.status.reason}" if out.status.reason else ""
            found.append(Mark(x.tick, kind, f"{mode.value}{reason}"))
        if self._controller not in ("", controller):
            found.append(Mark(x.tick, "controller", f"{self._controller} to {controller}"))
        touch = bool((out.cloud.verdict == CONTACT).any())
        if touch and not self._touch:
            found.append(Mark(x.tick, "touch", "a sensor is touched"))
        self._mode, self._controller, self._touch = mode, controller, touch
        return found

    def _new(self, action: Action, now: float) -> str:
        """In words; empty if it only goes on."""
        words = words_of(action)
        kind = type(action).__name__
        before, self._asked[kind] = self._asked.get(kind), now
        return "" if before is not None and now - before < SAME and kind in _DRAGGED else words


_DRAGGED = ("SetGoal", "MoveObstacle", "SetParams")


def words_of(action: Action) -> str:
    """What was asked for, in a few words."""
    match action:
        case SetMode(mode=mode):
            detail: Any = str(mode)
        case SetParams(changes=changes):
            detail = ", ".join(f"{k} = {v}" for k, v in changes.items())
        case Remark(words=words):
            detail = words
        case _:
            detail = getattr(action, "name", "") or getattr(action, "sensor", "")
    what = "".join(f" {c.lower()}" if c.isupper() else c for c in type(action).__name__).strip()
    return f"{what} {detail}".strip()[:LONGEST]
