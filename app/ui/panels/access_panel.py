"""Who operates, as one page is told it; with the button that takes control or gives it back.

These controls are the page's own: what is typed here goes to no other page.
"""

from collections.abc import Awaitable, Callable
from html import escape

import viser

from app.ui.access import Access, words
from app.ui.colours import CALM, DANGER, GREY, QUIET, css
from app.ui.inside import uuid_of
from app.ui.panels.assign import assign

Press = Callable[[int, str], Awaitable[None]]  # page, token typed; on the thread of the sockets
# the typed token as dots, in browsers that can
DOTS = (
    "<style>div:has(> .operator-token) + div input{-webkit-text-security:disc}</style>"
    '<span class="operator-token"></span>'
)


class AccessPanel:
    """A line, a field for the token where one is needed, and a button, on top of the page."""

    def __init__(
        self, client: viser.ClientHandle, access: Access, press: Press, what: str = "the arm"
    ) -> None:
        """what: is operated, in words."""
        gui, self._what = client.gui, what
        self.page, self._access = client.client_id, access
        self.line = gui.add_html("", order=-4.0)
        self._dots = gui.add_html(DOTS, order=-3.0)
        self.token = gui.add_text(
            "Operator token", "", order=-2.0, hint="told once; whoever started Flinch knows it"
        )
        self.button = gui.add_button("Take control", color=QUIET, order=-1.0)

        @self.button.on_click
        async def _(_: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            typed = self.token.value
            assign(self.token, "")
            await press(self.page, typed)

    @property
    def uuids(self) -> set[str]:
        """The page may always use these."""
        return {uuid_of(self.token), uuid_of(self.button)}

    def show(self, refusal: str = "") -> None:
        """Show who operates now; `refusal` is what the page was answered to its last wish."""
        operator, me = self._access.operator, words(self.page)
        if operator == self.page:
            self.line.content = line_html(f"You operate {self._what} ({me})", CALM, refusal)
        else:
            who = f"You watch ({me}); {words(operator)} operates"
            self.line.content = line_html(who, GREY, refusal)
        self.button.label = "Give control back" if operator == self.page else "Take control"
        self.token.visible = not self._access.trusts(self.page)


def line_html(text: str, colour: tuple[int, int, int], refusal: str) -> str:
    """One line with a dot of the colour, and a second in red if something was refused."""
    red = f'<div style="color:{css(DANGER)}">{escape(refusal)}</div>' if refusal else ""
    return (
        f'<div style="font-size:0.85em;padding:0.3em 0.8em 0.5em" data-role="{escape(text)}">'
        f'<span style="color:{css(colour)}">&#9679;</span> {escape(text)}{red}</div>'
    )
