"""The legend at the scene's lower edge: each entry is a switch of what it names.

Its controls are viser's boxes, each in the colour of what it stands for, lifted out of the panel by
their style. What is on is filled, or has a thick rim where the thing itself is hollow.
"""

from collections.abc import Iterable

import viser

from app.ui.colours import css
from app.ui.panels.view_panel import add_box
from app.ui.scene.switch import Switch

MARK = "flinch-legend"
BOX = f"div:has(> div > .{MARK})"
SHEET = f".mantine-Paper-root:has(.{MARK}):has([role=tablist])"  # all the panel, on a phone
FOLDER = f".mantine-Paper-root:has(> div > div > div > div > .{MARK})"


class Legend:
    """One box a switch that has a sign."""

    def __init__(self, server: viser.ViserServer, switches: Iterable[Switch]) -> None:
        shown = [s for s in switches if s.sign is not None]
        self.boxes: dict[str, viser.GuiCheckboxHandle] = {}
        with server.gui.add_folder("Legend"):
            server.gui.add_html(legend_style(shown))
            for switch in shown:
                self.boxes[switch.label] = add_box(server, switch)


def legend_style(switches: Iterable[Switch]) -> str:
    """What lifts the boxes out of the panel and gives each its colour; the style is their first."""
    colours = "".join(
        _colour(i + 2, css(s.sign.colour), s.sign.hollow)
        for i, s in enumerate(switches)
        if s.sign is not None
    )
    return f"""<style>
{FOLDER} {{ height: 0; margin: 0; padding: 0; border: 0 }}
{FOLDER} > :first-child {{ display: none }}
{BOX} {{ position: fixed; left: 12px; bottom: 12px; z-index: 5; display: flex; flex-wrap: wrap;
  gap: 0.2em 1.1em; max-width: calc(100vw - 440px); padding: 0.45em 0.8em; border-radius: 6px;
  background: color-mix(in srgb, var(--mantine-color-body) 88%, transparent) }}
div:has(> .{MARK}) {{ display: none }}
{BOX} > div {{ margin: 0 !important; padding: 0 !important }}
{BOX} > div > div {{ flex-direction: row-reverse; justify-content: flex-end; gap: 0.45em }}
{BOX} > div > div > div {{ width: auto !important; flex-grow: 0 !important; padding: 0 !important }}
{BOX} p {{ color: var(--mantine-color-text); letter-spacing: 0; white-space: nowrap }}
{BOX} input {{ cursor: pointer; width: 1.05em; height: 1.05em; min-height: 0; border-width: 2px }}
{BOX} svg {{ display: none }}
{BOX} label {{ cursor: pointer }}
{colours}
@media (max-width: 36em) {{
  {BOX} {{ left: 4px; right: 4px; top: 172px; bottom: auto; max-width: none; font-size: 0.8em;
    gap: 0.1em 0.8em }}
  {SHEET} {{ position: fixed !important; left: 0; right: 0; bottom: 58px; width: auto !important;
    max-height: 36vh !important }}
  {SHEET} .mantine-ScrollArea-content > div {{ width: 100% !important }}
}}
</style><span class="{MARK}" data-legend></span>"""


def _colour(child: int, colour: str, hollow: bool) -> str:
    box = f"{BOX} > :nth-child({child}) input"
    filled = "border-width:5px;background:transparent" if hollow else f"background:{colour}"
    return f"{box}{{border-color:{colour}!important}}{box}:checked{{{filled}!important}}\n"
