"""What is the matter with a port, in one word and in one sentence."""

from dataclasses import dataclass, field
from enum import StrEnum

from app.sensing.port import PortFacts
from app.sensing.rate import slow_words

NOISY_SHARE = 0.02  # of what came lately: more damage is worth a word
FORGET = 0.01  # weight of the newest frame in that share


class PortState(StrEnum):
    """The states that a port can be in; a page shows the word."""

    WAITING = "waiting"  # open, has not said anything yet
    UNKNOWN = "unknown format"  # bytes come, but no whole frame of a known format
    GOOD = "good"
    NOISY = "noisy"  # whole frames come, and damaged ones
    SILENT = "silent"  # has spoken, and says nothing any more
    GARBLED = "garbled"  # has spoken, and only damage comes
    SWAPPED = "swapped"  # speaks for sensors that another port should
    CONFLICT = "conflict"  # speaks for sensors that another port speaks for as well
    MISFIT = "misfit"  # speaks for a sensor that the layout does not have, or not so
    UNCLEAR = "unclear"  # what it prints cannot be right as its format says
    CLOCK = "bad clock"  # its stamps are none: nobody knows how old its frames are
    UNASSIGNED = "unassigned"  # its format names no sensor, and nobody has named one
    LOST = "lost"  # unplugged


@dataclass
class PortWatch:
    """Follows one port: what its frames were refused for, and how noisy it has become.

    spoken: sensors it has spoken for.   latency: [s] of its newest frame.
    refusal, because, refused_at: the last refusal.
    """

    spoken: set[int] = field(default_factory=set)
    refusal: PortState | None = None
    because: str = ""
    refused_at: float = float("-inf")
    noise: float = 0.0
    latency: float = 0.0
    _frames: int = 0
    _damaged: int = 0

    def refuse(self, state: PortState, because: str, now: float) -> None:
        """A frame at `now` [s] was not taken."""
        self.refusal, self.because, self.refused_at = state, because, now

    def count(self, facts: PortFacts) -> None:
        """Follow the share of damage; counts that fell are a new stream's."""
        if facts.frames < self._frames or facts.damaged < self._damaged:
            self._frames = self._damaged = 0
        good, bad = facts.frames - self._frames, facts.damaged - self._damaged
        self._frames, self._damaged = facts.frames, facts.damaged
        if good + bad:
            weight = 1.0 - (1.0 - FORGET) ** (good + bad)
            self.noise += weight * (bad / (good + bad) - self.noise)

    def state(self, facts: PortFacts, now: float, since: float, silence: float) -> PortState:
        """The state at `now` [s]; silence is counted from `since` [s] on."""
        if not facts.open:
            return PortState.LOST
        if self.refusal is not None and now - self.refused_at <= silence:
            return self.refusal
        if facts.trouble and facts.format and now - facts.heard <= silence:
            return PortState.UNCLEAR
        if facts.clock and now - facts.heard <= silence:
            return PortState.CLOCK
        quiet = now - max(facts.spoke, since) > silence
        bytes_come = now - facts.heard <= silence
        if facts.frames == 0:
            return PortState.UNKNOWN if bytes_come and quiet else PortState.WAITING
        if quiet:
            return PortState.GARBLED if bytes_come else PortState.SILENT
        return PortState.NOISY if self.noise > NOISY_SHARE else PortState.GOOD


def words(name: str, state: PortState, facts: PortFacts, watch: PortWatch, now: float) -> str:
    """One sentence about a port that is not as it should be."""
    match state:
        case PortState.LOST:
            return f"port {name} is lost ({facts.error})"
        case PortState.SILENT:
            slow = slow_words(facts.rate)
            return f"port {name} is silent for {now - facts.spoke:.1f} s{slow and '; '}{slow}"
        case PortState.GARBLED:
            return f"port {name} is garbled: no whole frame for {now - facts.spoke:.1f} s"
        case PortState.WAITING:
            return f"port {name} has not said anything yet"
        case PortState.UNKNOWN:
            why = facts.trouble or "check its speed and its program"
            return f"port {name} speaks no known format; {why}"
        case PortState.UNCLEAR:
            return f"port {name} is unclear: {facts.trouble}"
        case PortState.CLOCK:
            return f"port {name} has a bad clock: {facts.clock}"
    return f"port {name}: {watch.because or state.value}"


def rate_words(facts: PortFacts, state: PortState, watch: PortWatch) -> str:
    """A port's line on the page."""
    parts = (
        state.value,
        facts.format,
        f"{len(watch.spoken)} sensors" if watch.spoken else "",
        f"{100.0 * watch.noise:.0f} % damaged" if state is PortState.NOISY else "",
        f"{facts.lost} lost" if facts.lost else "",
        f"clock {1e6 * facts.drift:+.0f} ppm" if facts.drift else "",
        f"clock began anew {facts.restarts} times" if facts.restarts else "",
    )
    return " · ".join(p for p in parts if p)
