"""Roles on the page: pages come and go, one operates, and every page shows what it may do.

viser's controls are shared by all pages. What differs is sent to one page alone, beside the
shared state: its own line and button, and which of the shared controls look disabled. That is
for the eye; the right itself is looked at in the gate.
"""

import asyncio
import logging
from collections.abc import Callable, Collection
from typing import Any

import viser
from viser import _messages as m

from app.errors import AccessError
from app.messages import Snapshot
from app.ui.access import NotYetError, words
from app.ui.gate import Gate
from app.ui.inside import send, uuid_of
from app.ui.pacing import Every
from app.ui.panels.access_panel import AccessPanel

log = logging.getLogger(__name__)
FAINT = 0.25  # opacity of a handle that this page may not drag
DRAGS = (m.TransformControlsUpdateMessage, m.TransformControlsDragEndMessage)
HINTS = 3.0  # [s] between two notices to a page that its input was refused
GIVES = 0.5  # [s] until a page may give the lease back again: it is told to every page
TURN = 0.05  # [s] between two looks whether a token's turn has come


class Roles:
    """Ties the lease to one server. `let_go(page)` is called when a page has lost it."""

    def __init__(
        self,
        server: viser.ViserServer,
        gate: Gate,
        everybody: Collection[Any],
        let_go: Callable[[int], None],
        what: str = "the arm",
    ) -> None:
        """`everybody`: the controls that a page may use which only watches. `what` is operated."""
        self._server, self._gate, self._let_go, self._what = server, gate, let_go, what
        self._access, self._clock = gate.access, gate.clock
        self._may = f"stop {what}, or " if everybody else ""
        self.panels: dict[int, AccessPanel] = {}
        self._inside = gate.inside
        self._hints: dict[int, Every] = {}
        self._gives: dict[int, Every] = {}
        self._pressing: set[int] = set()
        self._pace = Every(0.5)
        self._shaded = self._seen = self._inside.shared()
        gate.free |= set(map(uuid_of, everybody))
        gate.open(self._answer)
        server.on_client_connect(self._arrive)
        server.on_client_disconnect(self._leave)

    def update(self, snapshot: Snapshot) -> None:
        """Shade anew after a control was enabled or disabled for all.

        That news is still held back while this runs, and would overtake what is sent to one
        page alone; so it is answered in the round after.
        """
        if not self._pace.due(snapshot.stamp):
            return
        seen, self._seen = self._seen, self._inside.shared()
        if seen == self._seen and seen != self._shaded:
            self._shaded = seen
            self._server.get_event_loop().call_soon_threadsafe(self._shade_all)

    async def _arrive(self, client: viser.ClientHandle) -> None:
        page = client.client_id
        self._access.arrive(page, self._clock.now())
        if self._access.operator == page:
            self._gate.know(page)
        self.panels[page] = panel = AccessPanel(client, self._access, self._press, self._what)
        self._hints[page], self._gives[page] = Every(HINTS), Every(GIVES)
        self._gate.free |= panel.uuids
        self._show()
        # news of a control that the page has not heard of yet would be lost on it
        heard, said = self._inside.heard(page), self._inside.said()
        while heard is not None and heard < said:
            await asyncio.sleep(0.05)
            heard = self._inside.heard(page)
        if page in self.panels:
            self._shade(client)

    async def _leave(self, client: viser.ClientHandle) -> None:
        page, before = client.client_id, self._access.operator
        panel = self.panels.pop(page, None)
        if panel is not None:
            self._gate.free -= panel.uuids
        self._hints.pop(page, None)
        self._gives.pop(page, None)
        self._access.leave(page)
        if self._access.operator != before:
            self._changed(before)

    async def _press(self, page: int, token: str) -> None:
        """The button of a page: give the lease back if it has it, else take it."""
        if page not in self.panels or page in self._pressing:
            return  # closed since, or its last press still waits for its turn
        self._pressing.add(page)
        before = self._access.operator
        try:
            if before == page:
                if not self._gives[page].due(self._clock.now()):
                    raise AccessError("control was given back just now; press again")
                self._access.release(page)
            else:
                before = await self._take(page, token)
        except AccessError as refused:
            self._gate.log.tell("control", f"{words(page)}: control refused: {refused}")
            if page in self.panels:
                self.panels[page].show(str(refused))
            return
        finally:
            self._pressing.discard(page)
            self._access.step_out(page)
        self._changed(before)

    async def _take(self, page: int, token: str) -> int | None:
        """Take the lease as soon as the token's turn has come. Returns who had it."""
        while True:
            try:
                self._access.tell(page, token, self._clock.now())
            except NotYetError as wait:
                self.panels[page].show(str(wait))
            else:
                before = self._access.operator
                self._access.take(page, self._clock.now())
                self._gate.know(page)
                return before
            await asyncio.sleep(TURN)

    def _changed(self, before: int | None) -> None:
        log.info("%s operates, after %s", words(self._access.operator), words(before))
        if before is not None:
            self._let_go(before)
        self._show()
        for page in (before, self._access.operator):
            client = self._server.get_clients().get(-1 if page is None else page)
            if client is not None:
                self._shade(client)

    def _show(self) -> None:
        for panel in self.panels.values():
            panel.show()

    def _answer(self, page: int, message: m.Message, why: str) -> None:
        """Tell a page whose input was refused what is true, and that it was refused."""
        client = self._server.get_clients().get(page)
        if client is None or page not in self._hints:
            return
        if isinstance(message, m.GuiUpdateMessage):
            handle = self._inside.handle(page, message.uuid)
            if handle is not None and not isinstance(handle, viser.GuiButtonHandle):
                send(client, m.GuiUpdateMessage(message.uuid, {"value": handle.value}))
        elif isinstance(message, DRAGS):
            node = self._server.scene.get_handle_by_name(message.name)
            if node is not None:
                (x, y, z), (w, *v) = map(float, node.position), map(float, node.wxyz)
                send(client, m.SetPositionMessage(message.name, (x, y, z)))
                send(client, m.SetOrientationMessage(message.name, (w, v[0], v[1], v[2])))
        if self._access.operator != page and self._hints[page].due(self._clock.now()):
            who = words(self._access.operator)
            client.add_notification(
                "You watch", f"{who} operates; you can {self._may}take control.",
                auto_close_seconds=4.0, color="gray",
            )  # fmt: skip

    def _shade(self, client: viser.ClientHandle) -> None:
        """Show a page which of the shared controls it may use."""
        watches = self._access.operator != client.client_id
        for uuid, disabled in self._inside.shared().items():
            if uuid not in self._gate.free:
                send(client, m.GuiUpdateMessage(uuid, {"disabled": watches or disabled}))
        for name, node in self._inside.gizmos():
            opacity = FAINT if watches else node.opacity
            send(client, m.SceneNodeUpdateMessage(name, {"opacity": opacity}))

    def _shade_all(self) -> None:
        for client in self._server.get_clients().values():
            self._shade(client)
