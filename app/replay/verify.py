"""Is what is computed anew what was decided then? The first tick and field that differs is named.

On the machine that recorded (the same processor and the same versions of what computes) every
field of every tick has to be the same to the last bit, whatever has become of Flinch's own code: a
changed constant is what this is meant to find. Elsewhere the last bits of sums differ (with another
BLAS and without AVX2 and FMA 3e-14 rad/s at most in 10 s of the cell); there the command, the
distance and the tool have to be within `TOLERANCE`, and the mode the same.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from app.brain import Brain
from app.record.fingerprint import Fingerprint, fingerprint_of
from app.record.recording import Recording
from app.record.witness import Witness, WitnessOf
from app.replay.brain_of import brain_of

TOLERANCE = {"qd": 1e-4, "distance": 1e-5, "tool": 1e-9}  # [rad/s], [m], [m]
OFTEN = 100  # ticks between two words of progress

Told = Callable[[int, int], None]


def nobody(done: int, of: int) -> None:
    """Nobody wants to know."""


@dataclass(frozen=True)
class Difference:
    """The first that was found: the tick's number and time [s] from the first, the names in
    `Outputs` of all that differs there, and what the first of them was and is, in words."""

    tick: int
    seconds: float
    fields: tuple[str, ...]
    expected: str
    got: str

    @property
    def field(self) -> str:
        """The first that differs, in the order of `Outputs`."""
        return self.fields[0]


@dataclass(frozen=True)
class Verdict:
    """ticks: that were compared.   exact: to the last bit, else within `TOLERANCE`.

    notes: what is not as it was on the machine or in the program that recorded, and what could
    not be compared.
    """

    ticks: int
    of: int
    exact: bool
    difference: Difference | None
    notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Was nothing found?"""
        return self.difference is None

    @property
    def words(self) -> str:
        """One line."""
        how = "to the last bit" if self.exact else f"within {tolerance_words()}"
        if self.difference is None:
            return f"ok: {self.ticks} of {self.of} ticks are the same {how}"
        d = self.difference
        more = f" (and in {', '.join(d.fields[1:])})" if len(d.fields) > 1 else ""
        return (
            f"differs at tick {d.tick} ({d.seconds:.3f} s) in {d.field}: "
            f"recorded {d.expected}, now {d.got}{more}; compared {how}"
        )

    def to_text(self) -> str:
        """The same with the notes below."""
        return "\n  ".join((self.words, *self.notes))

    def to_json(self) -> str:
        """One object."""
        content = {"what": "verify", "ok": self.ok, **asdict(self)}
        if not self.exact:
            content["tolerance"] = TOLERANCE
        return json.dumps(content, indent=2)


def verify(recording: Recording, told: Told = nobody, brain: Brain | None = None) -> Verdict:
    """Recompute every tick and compare it with its witness.

    brain: as it was before the first tick; made from the recording's head if it is left out.
    """
    brain = brain or brain_of(recording.head)
    exact, notes = how_exact(recording.head.fingerprint, fingerprint_of(brain.robot, brain.skin))
    witness_of, count = WitnessOf(), len(recording)
    if recording.torn:
        notes.append(f"it ends early: {recording.torn}")
    before: int | None = None
    for i in range(count):
        x = recording.inputs(i)
        if before is not None and x.tick != before + 1:
            missing = x.tick - before - 1
            notes.append(f"{missing} ticks are missing after tick {before}: no brain can go on")
            return Verdict(i, count, exact, None, tuple(notes))
        before = x.tick
        was, now = recording.witness(i), witness_of(brain.tick(x))
        found = compared(was, now, exact)
        if found is not None:
            seconds = float(recording.times[i] - recording.times[0])
            difference = Difference(x.tick, seconds, *found)
            return Verdict(i + 1, count, exact, difference, tuple(notes))
        if (i + 1) % OFTEN == 0 or i + 1 == count:
            told(i + 1, count)
    return Verdict(count, count, exact, None, tuple(notes))


def how_exact(then: Fingerprint, now: Fingerprint) -> tuple[bool, list[str]]:
    """Must all bits be the same? And what is not the same of machine and program, in words."""
    versions = [dict(f.versions) for f in (then, now)]
    for v in versions:
        v.pop("flinch", None)  # its own version says nothing of the machine
    same = then.processor == now.processor and versions[0] == versions[1]
    return same, [f"this is {words}" for words in now.differences(then)]


def compared(was: Witness, now: Witness, exact: bool) -> tuple[tuple[str, ...], str, str] | None:
    """The fields that differ, what the first one was and is; None if none does."""
    if exact:
        fields = [n for n, digest in was.digests.items() if now.digests.get(n) != digest]
    else:
        fields = [] if was.mode is now.mode else ["status"]
        for name, field in (("qd", "command"), ("distance", "body"), ("tool", "T_base_tool")):
            a, b = getattr(was, name), getattr(now, name)
            if not np.allclose(a, b, rtol=0.0, atol=TOLERANCE[name], equal_nan=True):
                fields.append(field)
    if not fields:
        return None
    expected, got = told_apart(fields[0], was, now)
    return tuple(fields), expected, got


def told_apart(name: str, was: Witness, now: Witness) -> list[str]:
    """The field's values where the witness has them and they differ, else its digests."""
    known: dict[str, Callable[[Witness], Any]] = {
        "command": lambda w: w.qd,
        "T_base_tool": lambda w: w.tool,
        "body": lambda w: w.distance,
        "status": lambda w: w.mode,
    }
    if name in known:
        words = [values(known[name](w)) for w in (was, now)]
        if words[0] != words[1]:
            return words
    return [f"digest {w.digests.get(name, b'').hex() or 'none'}" for w in (was, now)]


def values(value: Any) -> str:
    """Numbers with all of their digits, a mode by its name."""
    if isinstance(value, str):
        return str(value)
    array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    words = ", ".join(repr(float(v)) for v in array)
    return words if array.size == 1 else f"({words})"


def tolerance_words() -> str:
    """The tolerance, for a person."""
    return (
        f"{TOLERANCE['qd']:g} rad/s, {1e3 * TOLERANCE['distance']:g} mm of distance and "
        f"{1e3 * TOLERANCE['tool']:g} mm of the tool"
    )
