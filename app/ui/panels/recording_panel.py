"""What a recording is: when, of what, by which version; and its marks, to go to."""

from collections.abc import Sequence
from html import escape
from typing import Any

import viser

from app.messages import Snapshot
from app.record.marks import Mark
from app.replay.facts import facts
from app.replay.player import Player
from app.replay.survey import Survey
from app.timing import Clock
from app.ui.pacing import Every
from app.ui.panels.health_panel import table

PERIOD = 0.5  # [s]
LONGEST = 60  # characters of a mark in the list
MOST = 300  # marks in the list
NOWHERE = "(a mark)"


class RecordingPanel:
    """A list of the marks, a line about the survey, and tables of facts."""

    def __init__(
        self, server: viser.ViserServer, player: Player, survey: Survey, clock: Clock
    ) -> None:
        gui, recording = server.gui, player.timeline.recording
        self._survey, self._clock, self._pace = survey, clock, Every(PERIOD)
        marks = recording.marks[:MOST]
        self._places = dict(
            zip(mark_words(player, marks), (player.place_of(m.tick) for m in marks), strict=True)
        )
        self.marks = gui.add_dropdown(
            "Go to", (NOWHERE, *self._places), hint="stops, switches, touches, wishes of people"
        )
        self.survey = gui.add_html("")
        rows = [(escape(name), escape(words)) for name, words in facts(recording)]
        self.facts = gui.add_html(table("This recording", rows))

        @self.marks.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            place = self._places.get(event.target.value)
            if event.client_id is not None and place is not None:
                player.seek(place)

    def update(self, snapshot: Snapshot) -> None:
        self.refresh()

    def refresh(self) -> None:
        """How far the survey is, also while the recording stands still."""
        if self._pace.due(self._clock.now()):
            content = survey_html(self._survey)
            if content != self.survey.content:
                self.survey.content = content


def survey_html(survey: Survey) -> str:
    """Empty once it is done."""
    if survey.done:
        return ""
    text = f"gone through in the background: {100.0 * survey.share:.0f} %"
    return f'<div style="font-size:0.85em;padding:0 0.8em 0.4em">{text}</div>'


def mark_words(player: Player, marks: Sequence[Mark]) -> list[str]:
    """Time, kind and words of each mark, no two alike."""
    out = []
    for i, mark in enumerate(marks, 1):
        seconds = player.seconds(player.place_of(mark.tick))
        words = f"{i}: {seconds:.2f} s, {mark.kind}: {mark.words}"
        out.append(words if len(words) <= LONGEST else f"{words[: LONGEST - 1]}…")
    return out
