"""The pump: 30 times a second the newest snapshot goes to every view.

With no browser connected nothing is done. A view that fails is not left out quietly: the
pump stops the arm, tells every window, and lets the exception out of its thread.
"""

import threading
from collections.abc import Callable, Sequence
from typing import Protocol

import viser

from app.actions import SetMode
from app.messages import Mode, Snapshot
from app.timing import Clock, Ticker
from app.ui.engine import Engine
from app.ui.traffic import Traffic

PERIOD = 1.0 / 30.0  # [s]
SILENCE = 1.0  # [s] without a new snapshot before the page says so


class View(Protocol):
    """Whatever shows something: handles built once, `update` only assigns."""

    def update(self, snapshot: Snapshot) -> None: ...


class Pump:
    """Feeds views from `engine.snapshots` in a thread of its own."""

    def __init__(
        self,
        server: viser.ViserServer,
        engine: Engine,
        views: Sequence[View],
        clock: Clock,
        traffic: Traffic,
        on_silence: Callable[[float], None],
    ) -> None:
        self.fault: Exception | None = None
        self._traffic = traffic
        self._server, self._engine, self._views, self._clock = server, engine, views, clock
        self._on_silence = on_silence
        self._seen: Snapshot | None = None
        self._seen_at = clock.now()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ui pump", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def step(self) -> bool:
        """Show the newest snapshot; False when there is none that is new."""
        snapshot, _ = self._engine.snapshots.get()
        now = self._clock.now()
        if snapshot is None or snapshot is self._seen:
            if now - self._seen_at > SILENCE:
                self._on_silence(now - self._seen_at)
            return False
        self._seen, self._seen_at = snapshot, now
        with self._server.atomic(), self._traffic.frame(now):
            for view in self._views:
                view.update(snapshot)
        return True

    def _run(self) -> None:
        ticker = Ticker(self._clock, PERIOD)
        try:
            while not self._stop.is_set():
                ticker.wait()
                if self._server.get_clients():
                    self.step()
        except Exception as e:
            self.fault = e
            reason = f"page: {type(e).__name__}: {e}".splitlines()[0]
            self._engine.post(SetMode(Mode.STOPPED, reason=reason))
            for client in self._server.get_clients().values():
                client.add_notification(
                    "The page has failed and the arm is stopped", reason, color="red"
                )
            raise
