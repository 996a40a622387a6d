"""What the page says of the arm, as a person would say it."""

from collections.abc import Sequence

from app.messages import Mode, Snapshot

WORD = {
    Mode.IDLE: ("Idle", "stands still until the sensors have spoken"),
    Mode.RUNNING: ("Running", "goes to the goal and gives way"),
    Mode.HOLDING: ("Holding", "stays where it is and gives way"),
    Mode.STOPPED: ("Stopped", "stands still"),
}


def link_words(link: str) -> str:
    """`upper_arm_link` as `upper arm`."""
    words = [w for w in link.split("_") if w not in ("link", "inertia")]
    return " ".join(words) or link


def state_words(snapshot: Snapshot) -> tuple[str, str]:
    """The state in a word; and what it means, why, and what holds the arm back."""
    word, meaning = WORD[snapshot.status.mode]
    reason, advice = snapshot.status.reason, snapshot.advice
    why = f"{meaning}: {reason}" if reason else meaning
    return word, f"{why} · {advice}" if advice else why


def closest_words(snapshot: Snapshot, links: Sequence[str]) -> str:
    """The smallest distance that the controller looks at, and what the avoidance does of it."""
    pairs, activation = snapshot.pairs, snapshot.command.activation
    if pairs.closest < 0:
        return "Nothing in sight of the skin"
    near = f"Closest {100.0 * pairs.minimum:.0f} cm at the {links[int(pairs.link[pairs.closest])]}"
    if snapshot.status.mode in (Mode.STOPPED, Mode.IDLE):
        return near
    if 0.0 < activation < 1.0:
        return f"{near} · gives way ({100.0 * activation:.0f} %)"
    return f"{near} · {'gives way' if activation > 0.0 else 'free'}"
