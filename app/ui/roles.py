"""Roles on the page: pages come and go, one operates, and every page shows what it may do.

viser's controls are shared by all pages. What differs is sent to one page alone, beside the
shared state: its own line and button, and which of the shared controls look disabled. That is
for the eye; the right itself is looked at in the gate.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable
from typing import Any

import viser
from viser import _messages as m

from app.errors import AccessError
from app.messages import Snapshot
from app.ui.access import words
from app.ui.gate import Gate
from app.ui.pacing import Every
from app.ui.panels.access_panel import AccessPanel

log = logging.getLogger(__name__)
FAINT = 0.25  # opacity of a handle that this page may not drag
DRAGS = (m.TransformControlsUpdateMessage, m.TransformControlsDragEndMessage)
HINTS = 3.0  # [s] between two notices to a page that its input was refused


class Roles:
    """Ties the lease to one server. `let_go(page)` is called when a page has lost it."""

    def __init__(
        self,
        server: viser.ViserServer,
        gate: Gate,
        everybody: Iterable[Any],
        let_go: Callable[[int], None],
    ) -> None:
        """`everybody`: the controls that a page may use which only watches."""
        self._server, self._gate, self._let_go = server, gate, let_go
        self._access, self._clock = gate.access, gate.clock
        self.panels: dict[int, AccessPanel] = {}
        self._hints: dict[int, Every] = {}
        self._pace, self._told = Every(0.5), Every(1.0)
        self._shaded = self._seen = self._controls()
        gate.free |= {handle._impl.uuid for handle in everybody}
        gate.open(server, self._answer)
        server.on_client_connect(self._arrive)
        server.on_client_disconnect(self._leave)

    def update(self, snapshot: Snapshot) -> None:
        """Shade anew after a control was enabled or disabled for all.

        That news is still held back while this runs, and would overtake what is sent to one
        page alone; so it is answered in the round after.
        """
        if not self._pace.due(snapshot.stamp):
            return
        seen, self._seen = self._seen, self._controls()
        if seen == self._seen and seen != self._shaded:
            self._shaded = seen
            self._server.get_event_loop().call_soon_threadsafe(self._shade_all)

    async def _arrive(self, client: viser.ClientHandle) -> None:
        page = client.client_id
        self._access.arrive(page, self._clock.now())
        self.panels[page] = panel = AccessPanel(client, self._access, self._press)
        self._hints[page] = Every(HINTS)
        self._gate.free |= panel.uuids
        self._show()
        # news of a control that the page has not heard of yet would be lost on it
        heard, said = self._heard(page), self._said()
        while heard is not None and heard < said:
            await asyncio.sleep(0.05)
            heard = self._heard(page)
        if page in self.panels:
            self._shade(client)

    async def _leave(self, client: viser.ClientHandle) -> None:
        page, before = client.client_id, self._access.operator
        panel = self.panels.pop(page, None)
        if panel is not None:
            self._gate.free -= panel.uuids
        self._hints.pop(page, None)
        self._access.leave(page)
        if self._access.operator != before:
            self._changed(before)

    def _press(self, page: int, token: str) -> None:
        """The button of a page: give the lease back if it has it, else take it."""
        before, now = self._access.operator, self._clock.now()
        if page not in self.panels:  # closed since
            return
        try:
            if before == page:
                self._access.release(page)
            else:
                self._access.tell(page, token, now)
                self._access.take(page, now)
        except AccessError as refused:
            if self._told.due(now):
                log.warning("%s: control refused: %s", words(page), refused)
            self.panels[page].show(str(refused))
            return
        self._changed(before)

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
        send = client._websock_connection.queue_message
        if isinstance(message, m.GuiUpdateMessage):
            handle = self._gate.handle(page, message.uuid)
            if handle is not None and not handle._impl.is_button:
                send(m.GuiUpdateMessage(message.uuid, {"value": handle.value}))
        elif isinstance(message, DRAGS):
            node = self._server.scene.get_handle_by_name(message.name)
            if node is not None:
                (x, y, z), (w, *v) = map(float, node.position), map(float, node.wxyz)
                send(m.SetPositionMessage(message.name, (x, y, z)))
                send(m.SetOrientationMessage(message.name, (w, v[0], v[1], v[2])))
        if self._access.operator != page and self._hints[page].due(self._clock.now()):
            who = words(self._access.operator)
            client.add_notification(
                "You watch", f"{who} operates; you can stop the arm, or take control.",
                auto_close_seconds=4.0, color="gray",
            )  # fmt: skip

    def _shade(self, client: viser.ClientHandle) -> None:
        """Show a page which of the shared controls it may use."""
        watches = self._access.operator != client.client_id
        send = client._websock_connection.queue_message
        for uuid, disabled in self._controls().items():
            if uuid not in self._gate.free:
                send(m.GuiUpdateMessage(uuid, {"disabled": watches or disabled}))
        for name, node in list(self._server.scene._handle_from_transform_controls_name.items()):
            send(m.SceneNodeUpdateMessage(name, {"opacity": FAINT if watches else node.opacity}))

    def _shade_all(self) -> None:
        for client in self._server.get_clients().values():
            self._shade(client)

    def _controls(self) -> dict[str, bool]:
        """Whether each of the shared controls is disabled for all."""
        known: dict[str, Any] = self._server.gui._gui_input_handle_from_uuid
        return {uuid: handle._impl.props.disabled for uuid, handle in list(known.items())}

    def _said(self) -> int:
        """Number of the last message to all."""
        return self._server._websock_server._broadcast_buffer.message_counter - 1

    def _heard(self, page: int) -> int | None:
        """Number of the last message to all that was sent to the page; None if it is gone."""
        return self._server._websock_server._broadcast_buffer.generator_cursors.get(page)
