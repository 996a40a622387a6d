"""The settings that were in force at the moment that is shown: to read, not to change."""

from html import escape

import viser

from app.config import Params, Tunable, tunables
from app.messages import Snapshot
from app.ui.panels.health_panel import Rows, table


class SettingsPanel:
    """A table for each group of settings; what is not at its default stands out."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._shown: Params | None = None
        self.table = server.gui.add_html("")

    def update(self, snapshot: Snapshot) -> None:
        if snapshot.params != self._shown:
            self._shown = snapshot.params
            self.table.content = settings_html(snapshot.params)


def settings_html(params: Params) -> str:
    """One table a group."""
    groups: dict[str, Rows] = {}
    for t in tunables():
        groups.setdefault(t.group, []).append((escape(t.label), value_html(t, params)))
    return "".join(table(escape(group), rows) for group, rows in groups.items())


def value_html(t: Tunable, params: Params) -> str:
    """The value with its unit, bold where it is not the default."""
    value = getattr(params, t.name)
    if t.kind is bool:
        words = "on" if value else "off"
    else:
        words = escape(f"{value:g} {t.unit}".strip() if isinstance(value, float) else str(value))
    return words if value == t.default else f"<b>{words}</b>"
