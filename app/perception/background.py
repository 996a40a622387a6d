"""Learning the background: where the world was while nothing moved.

While learning, the cubes of all kept points are counted. A cube belongs to the background if
it was seen in the first and in the last half of the time, so that who walks through is not
learned. What has been learned is a preview, and changes nothing, until a person keeps it:
someone who stood still is in it as well. It is then added to what was known before.
"""

from collections import Counter

import numpy as np

from app.cell.learned import NOTHING_LEARNED, Learned, cells_of, cubes_at, keys_of
from app.errors import SensorError
from app.messages import Array, BackgroundView

LEAST = 2  # times a cube is seen in each half
LONGEST = 60.0  # [s] of learning


class Background:
    """What is known, what has just been learned, and the learning that runs."""

    def __init__(self, known: Learned = NOTHING_LEARNED) -> None:
        self.known = known
        self._known_centres = known.centres()
        self._forget_preview()

    @property
    def learning(self) -> bool:
        """Is it being learned just now?"""
        return bool(np.isfinite(self._until))

    def learn(self, now: float, seconds: float) -> None:
        """Begin anew, without the preview there was; `finish` is due after `seconds`."""
        if not isinstance(seconds, int | float) or not 0.0 < seconds <= LONGEST:
            raise SensorError(f"cannot learn for {seconds!r} s; give up to {LONGEST:g} s")
        self._forget_preview()
        self._half, self._until = now + seconds / 2, now + seconds

    def count_points(self, points: Array, now: float) -> None:
        """Kept points (n, 3) [m] of one frame, base frame."""
        if self.learning:
            half = self._seen if now < self._half else self._later
            half.update(keys_of(cubes_at(points)).tolist())

    def finish(self, now: float) -> bool:
        """Ends the learning when its time is over; tells whether it did just now."""
        if not self.learning or now < self._until:
            return False
        seen, later = self._seen, self._later
        keys = [k for k, n in seen.items() if n >= LEAST and later[k] >= LEAST]
        self._forget_preview()
        self.preview = Learned.of(cells_of(np.array(keys, dtype=np.int64)))
        self._preview_centres = self.preview.centres()
        return True

    def keep(self) -> None:
        """Add the preview to what is known."""
        if not len(self.preview):
            raise SensorError("nothing has been learned that could be kept; learn it first")
        self._know(self.known.with_more(self.preview))
        self._forget_preview()

    def discard(self) -> None:
        """End the learning and drop its preview; what was known stays known."""
        self._forget_preview()

    def forget(self) -> None:
        """Know nothing any more; also ends the learning."""
        self._know(NOTHING_LEARNED)
        self._forget_preview()

    def view(self, now: float) -> BackgroundView:
        """For onlookers; the same arrays as long as nothing changes."""
        left = max(self._until - now, 0.0) if self.learning else 0.0
        return BackgroundView(self._known_centres, self._preview_centres, left)

    def _know(self, learned: Learned) -> None:
        self.known, self._known_centres = learned, learned.centres()

    def _forget_preview(self) -> None:
        self.preview = NOTHING_LEARNED
        self._preview_centres = self.preview.centres()
        self._half = self._until = -np.inf
        self._seen: Counter[int] = Counter()
        self._later: Counter[int] = Counter()
