"""What the page reads out: one choice and one pace for the scene, the panel and the charts.

The closest point hops among links and its distance trembles; read at three paces it was three
numbers for one thing. Here it is read `PERIOD` apart, and a link that is told stays for `STAYS`.
"""

from collections import deque

import numpy as np

from app.messages import Snapshot
from app.near import NOT_NEAR, Near
from app.robot.model import Robot
from app.ui.colours import ALARM, CALM, NEAR, RGB, WARN
from app.ui.pacing import Every
from app.ui.words import distance_kept, link_words, pace_words, too_near, why_fixed

PERIOD = 0.2  # [s] faster than this nobody reads numbers
STAYS = 0.5  # [s] a link is told at least for so long
TOUCH = 0.02  # [m] nearer than this is an alarm
SPAN = 2.0  # [s] over which the loop's pace is looked at


class Held:
    """The pair that is told; another link takes its place after `stays` seconds."""

    def __init__(self, stays: float) -> None:
        self.near, self._stays = NOT_NEAR, stays
        self._since = float("-inf")

    def take(self, near: Near, now: float) -> None:
        """The closest pair at `now` [s]."""
        if near.link != self.near.link:
            if 0.0 <= now - self._since < self._stays:
                return
            self._since = now
        self.near = near


class Pace:
    """How fast the control loop really runs, over the last seconds."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int, float]] = deque()  # [s], tick, [s] late

    def take(self, snapshot: Snapshot) -> None:
        seen = self._seen
        if seen and not (seen[-1][0] <= snapshot.stamp and seen[-1][1] <= snapshot.tick):
            seen.clear()  # started anew
        seen.append((snapshot.stamp, snapshot.tick, snapshot.timing.lateness))
        while snapshot.stamp - seen[0][0] > SPAN:
            seen.popleft()

    def words(self, snapshot: Snapshot) -> str:
        """What is too slow or too old; empty if nothing is, or too little is known yet."""
        (t0, n0, _), (t1, n1, _) = self._seen[0], self._seen[-1]
        if t1 - t0 < SPAN / 2.0:
            return ""
        late = float(np.median([row[2] for row in self._seen]))
        delay = snapshot.delay[np.isfinite(snapshot.delay)]
        behind = float(np.median(delay)) if len(delay) else 0.0
        return pace_words((n1 - n0) / (t1 - t0), snapshot.timing.rate, late, behind)


class Reading:
    """The first of the views: what the others tell of distance, they take from here.

    anew: counts up whenever there is something new to tell.
    """

    def __init__(self, robot: Robot, stays: float = STAYS) -> None:
        """stays: [s]; 0 for a recording, of which each tick is looked at by itself."""
        self.links = tuple(map(link_words, robot.links))
        self.reasons = why_fixed(robot)
        self.anew = 0
        self.pace = ""  # what is too slow or too old
        self.kept: float | None = None  # [m]
        self.colour: RGB = CALM
        self._yields, self._stays = Held(stays), Held(stays)
        self._loop, self._pace = Pace(), Every(PERIOD)

    @property
    def yields(self) -> Near:
        """The closest pair that can give way."""
        return self._yields.near

    @property
    def stays(self) -> Near:
        """The closest that cannot."""
        return self._stays.near

    def update(self, snapshot: Snapshot) -> None:
        self._loop.take(snapshot)
        if not self._pace.due(snapshot.stamp):
            return
        self.anew += 1
        self._yields.take(snapshot.nearness.yields, snapshot.stamp)
        self._stays.take(snapshot.nearness.stays, snapshot.stamp)
        self.kept = distance_kept(snapshot)
        self.colour = near_colour(self.yields, self.kept, snapshot.command.activation)
        self.pace = self._loop.words(snapshot)


def near_colour(near: Near, kept: float | None, activation: float) -> RGB:
    """Green: free. Blue: the avoidance acts. Amber: nearer than is kept. Red: all but touched."""
    if near.seen and near.distance < TOUCH:
        return ALARM
    if too_near(near, kept):
        return WARN
    return NEAR if activation > 0.0 else CALM
