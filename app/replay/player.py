"""Plays a recording to a page: in its own time, faster, slower, a tick at a time, from anywhere.

It looks like an engine to the page, but nothing can be asked of the arm: what happened has
happened. One thread computes; whoever calls leaves a wish and returns at once. Where a tick takes
longer than it should the recording plays slower, and what is far away is computed in slices, so
that a new wish is never kept waiting.
"""

import logging
import threading

import numpy as np

from app.actions import Action, SetMode
from app.messages import Mode, Snapshot
from app.replay.ticks import ticks_of
from app.replay.timeline import Timeline
from app.timing import Clock, Latest

log = logging.getLogger(__name__)
PICTURE = 1.0 / 30.0  # [s] a page shows no more
SLOWEST, FASTEST = 0.1, 4.0
BEHIND = 0.25  # [s] of its own time that playing may be late before it is honest about its speed
IDLE = 0.2  # [s] between two looks for a wish while there is nothing to do


class Player:
    """The engine of a replay's page. `start` runs it in a thread; `turn` is one round of that."""

    def __init__(self, timeline: Timeline, clock: Clock, source: str = "") -> None:
        brain, head = timeline.mind.brain, timeline.recording.head
        self.robot, self.skin, self.cell = brain.robot, brain.skin, brain.cell
        self.source, self.scene = source, head.scene
        self.editable = False  # what has happened
        self.programs: tuple[str, ...] = ()  # none can be run
        self.snapshots: Latest[Snapshot] = Latest()
        self.fault = ""  # what ended it; empty while nothing has
        self.timeline = timeline
        self.times, self.ticks = np.asarray(timeline.recording.times), ticks_of(timeline.recording)
        self.at, self.playing, self.speed = -1, False, 1.0
        self._clock = clock
        self._wish: int | None = 0  # the tick that is wanted; None: the one that is shown
        self._anchor = (0.0, 0.0)  # (clock, recording) [s] at which both were together
        self._news = threading.Condition(threading.RLock())
        self._quit = False
        self._thread: threading.Thread | None = None

    # --- wishes, from any thread ----------------------------------------------------------

    @property
    def last(self) -> int:
        """The last tick."""
        return len(self.times) - 1

    @property
    def wanted(self) -> int | None:
        """The tick that is being computed because somebody wants to see it."""
        return self._wish

    def play(self) -> None:
        """From here on; from the beginning when it is at the end."""
        with self._news:
            here = self._wish if self._wish is not None else self.at
            if here >= self.last:
                here = self._wish = 0
            self.playing = True
            self._set_anchor(here)
            self._news.notify()

    def pause(self) -> None:
        """Stay at the tick that is shown."""
        with self._news:
            self.playing = False
            self._news.notify()

    def toggle(self) -> None:
        """Play if it stands, else pause."""
        self.pause() if self.playing else self.play()

    def step(self, count: int) -> None:
        """Pause, and go so many ticks on; back if negative."""
        with self._news:
            here = self._wish if self._wish is not None and not self.playing else self.at
            self.playing = False
            self.seek(here + count)

    def seek(self, i: int) -> None:
        """Go to place i, or to the end that is nearest to it, and go on as before."""
        with self._news:
            self._wish = min(max(i, 0), self.last)
            self._set_anchor(self._wish)
            self._news.notify()

    def seek_time(self, seconds: float) -> None:
        """Go to the tick at `seconds` from the first one."""
        self.seek(self.tick_at(self.times[0] + seconds) if len(self.times) else 0)

    def set_speed(self, speed: float) -> None:
        """So many times as fast as it was; held between `SLOWEST` and `FASTEST`."""
        with self._news:
            self.speed = min(max(speed, SLOWEST), FASTEST)
            self._set_anchor(self.at)

    def post(self, action: Action) -> None:
        """Of what a page can ask of an arm only Stop means anything here: it pauses."""
        if isinstance(action, SetMode) and action.mode is Mode.STOPPED:
            self.pause()

    def tick_at(self, stamp: float) -> int:
        """The last tick at or before `stamp` [s] on the recording's clock; the first if none is."""
        return max(int(np.searchsorted(self.times, stamp + 1e-9, side="right")) - 1, 0)

    def place_of(self, tick: int) -> int:
        """Where the tick of this number is in the recording; the next one where it is missing."""
        return min(int(np.searchsorted(self.ticks, tick)), self.last)

    def seconds(self, i: int) -> float:
        """[s] from the first tick to the one at place i."""
        return float(self.times[i] - self.times[0])

    # --- the thread -----------------------------------------------------------------------

    def start(self) -> None:
        """Run in a thread of its own until `stop`."""
        self._quit = False
        self._thread = threading.Thread(target=self._run, name="flinch-replay", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        with self._news:
            self._quit = True
            self._news.notify()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def turn(self) -> float:
        """One round: show what is due, compute ahead in the time that is left.

        Returns for how long [s] there is nothing to do.
        """
        began = self._clock.now()

        def over() -> bool:
            return self._clock.now() - began >= PICTURE or self._quit

        want = self._due(began)
        if want is not None and want != self.at:
            arrived = self.timeline.reach(want, over)
            if arrived:
                self._show(want)
            elif self.playing and self._wish is None:
                self._show(self.timeline.computed)
        self._arrange(want)
        if self._wish is not None:
            return 0.0
        if self.playing:
            return max(PICTURE - (self._clock.now() - began), 0.0)
        return IDLE if over() or self.timeline.explore(over) else 0.0

    def _due(self, now: float) -> int | None:
        """The tick that should be on show: a wish first, else what time asks for."""
        with self._news:
            if self._wish is not None:
                return self._wish
            if not self.playing:
                return None
            clock, recorded = self._anchor
            return self.tick_at(recorded + (now - clock) * self.speed)

    def _arrange(self, want: int | None) -> None:
        """Forget a wish that is fulfilled, end at the end, and be honest about being late."""
        with self._news:
            if self._wish is not None and self._wish == self.at:
                self._wish = None
                self._set_anchor(self.at)
            elif (
                self.playing
                and want is not None
                and self._wish is None
                and self.times[want] - self.times[self.at] > BEHIND
            ):
                self._set_anchor(self.at)
            if self.playing and self._wish is None and self.at >= self.last:
                self.playing = False

    def _show(self, i: int) -> None:
        self.at = i
        snapshot = self.timeline.snapshot(i)
        self.snapshots.put(snapshot, snapshot.stamp)

    def _set_anchor(self, i: int) -> None:
        here = float(self.times[max(i, 0)]) if len(self.times) else 0.0
        self._anchor = (self._clock.now(), here)

    def _run(self) -> None:
        try:
            while not self._quit:
                wait = self.turn()
                with self._news:
                    if wait > 0.0 and not self._quit and self._wish is None:
                        self._news.wait(wait)
        except Exception as error:
            log.exception("the replay has failed")
            self.fault = f"the replay has failed: {error!r}"
            self.playing = False
