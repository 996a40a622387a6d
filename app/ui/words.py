"""What the page says of the arm, as a person would say it. Pure: a snapshot in, words out."""

from collections.abc import Sequence

from app.control.registry import kind_of
from app.messages import Mode, Snapshot
from app.near import Near, Nearness
from app.robot.model import Robot

WORD = {
    Mode.IDLE: ("Idle", "stands still until the sensors have spoken"),
    Mode.RUNNING: ("Running", "goes to the goal and gives way"),
    Mode.HOLDING: ("Holding", "stays where it is and gives way"),
    Mode.STOPPED: ("Stopped", "stands still"),
}
MOVING = (Mode.RUNNING, Mode.HOLDING)
TOLERATED = 0.01  # [m] nearer than kept by less than this is the sensors' noise
AWAY = 0.05  # [m] a goal nearer than this is not worth a word
SLOW = 0.85  # share of the ticks asked for, below which the computer is too slow
LATE = 0.005  # [s] a tick that usually begins so late is late
OLD = 0.15  # [s] from measuring to use: two frames of a sensor


def link_words(link: str) -> str:
    """`upper_arm_link` as `upper arm`."""
    words = [w for w in link.split("_") if w not in ("link", "inertia")]
    return " ".join(words) or link


def why_fixed(robot: Robot) -> tuple[str, ...]:
    """Of each link, why its closest point may be one that cannot give way."""
    moved_by = robot.supports.astype(bool).sum(axis=1)
    words = ("stands still", "can only turn about the base", "can only turn past it")
    return tuple(words[min(int(n), 2)] for n in moved_by)


def centimetres(distance: float) -> str:
    """`27 cm`."""
    return f"{100.0 * distance:.0f} cm"


def state_words(snapshot: Snapshot) -> tuple[str, str]:
    """The state in a word; and what it means, why, and what else holds the arm back."""
    word, meaning = WORD[snapshot.status.mode]
    reason, advice = snapshot.status.reason, snapshot.advice
    why = f"{meaning}: {reason}" if reason else meaning
    said = snapshot.nearness.blocked > 0.0 and advice.startswith("blocked: something")
    return word, f"{why} · {advice}" if advice and not said else why


def distance_kept(snapshot: Snapshot) -> float | None:
    """[m] that the controller in force keeps; None of one that keeps none."""
    distances = kind_of(snapshot.params.mode).distances(snapshot.params)
    return None if distances is None else distances[0]


def too_near(near: Near, kept: float | None) -> bool:
    """Is it nearer than what is kept, by more than the noise?"""
    return kept is not None and near.seen and near.distance < kept - TOLERATED


def yielding_words(near: Near, links: Sequence[str], kept: float | None) -> str:
    """The closest point that can give way; `kept`: see `distance_kept`."""
    if not near.seen:
        return "Nothing in sight that it could give way to"
    words = f"{links[near.link].capitalize()}, {centimetres(near.distance)}"
    if too_near(near, kept):
        return f"{words}: closer than kept ({100.0 * (kept or 0.0):.0f})"
    return f"{words}{'' if kept is None else f' (keeps {100.0 * kept:.0f})'}: can give way"


def fixed_words(near: Near, links: Sequence[str], reasons: Sequence[str]) -> str:
    """The closest point that cannot give way, and why; empty where there is none."""
    if not near.seen:
        return ""
    name = links[near.link].capitalize()
    return f"{name}, {centimetres(near.distance)}: {reasons[near.link]}"


def doing_words(snapshot: Snapshot, links: Sequence[str]) -> str:
    """What the controller does about what is near; empty while the arm may not move."""
    if snapshot.status.mode not in MOVING:
        return ""
    command, near = snapshot.command, snapshot.nearness
    who = _holder(near, links)
    if near.blocked > 0.0:
        by = f" by {who}" if who else ""
        away = f", goal {centimetres(near.to_go)} away" if near.to_go > AWAY else ""
        return f"Blocked{by}, since {near.blocked:.0f} s{away}"
    if command.activation <= 0.0:
        return "Free"
    if not who:
        return "Slowed by its own body or the cell"
    verb = "Pushed back" if command.reference > 0.0 else "Slowed"
    return f"{verb} by {who}"


def _holder(near: Nearness, links: Sequence[str]) -> str:
    """The link that the avoidance acts on, with its distance; empty for none."""
    return f"{links[near.holder]} at {centimetres(near.held_at)}" if near.holder >= 0 else ""


def closest_words(snapshot: Snapshot, links: Sequence[str]) -> str:
    """Both in one line, for a film: what can give way, and what the controller does."""
    near, does = snapshot.nearness.yields, doing_words(snapshot, links)
    if not near.seen:
        return "Nothing in sight of the skin"
    words = f"{centimetres(near.distance)} at the {links[near.link]}"
    return f"{words} · {does.lower()}" if does else words


def pace_words(rate: float, asked: float, late: float, delay: float) -> str:
    """What is too slow or too old to be trusted; empty if nothing is.

    rate, asked: [Hz] ticks that were made, and that should be.   late: [s] how late they begin.
    delay: [s] from measuring to use, of the sensors in the middle.
    """
    if asked > 0.0 and rate < SLOW * asked:
        return f"Slow computer: {rate:.0f} of {asked:.0f} Hz"
    if late > LATE:
        return f"Late loop: begins {1000.0 * late:.0f} ms late"
    if delay > OLD:
        return f"Old data: the sensors are {1000.0 * delay:.0f} ms behind"
    return ""
