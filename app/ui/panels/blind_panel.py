"""Sensors that look into the arm: told above everything else for as long as it is so."""

from html import escape

import viser

from app.robot.blind import blind_words
from app.ui.colours import ALARM, css
from app.ui.engine import Engine


def show_blind(server: viser.ViserServer, engine: Engine) -> viser.GuiHtmlHandle | None:
    """One line for each body that sensors look into; nothing where all look out."""
    lines = blind_words(engine.robot, engine.skin)
    if not lines:
        return None
    body = "".join(f"<div>{escape(line)}</div>" for line in lines)
    return server.gui.add_html(
        f'<div style="margin:0 4% 0.7em;padding-left:0.5em;font-size:0.85em;line-height:1.4;'
        f'border-left:0.45em solid {css(ALARM)}">{body}</div>'
    )
