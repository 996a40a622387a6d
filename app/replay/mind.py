"""What is stepped along a recording: the brain that was, and maybe a ghost."""

from app.brain import Brain
from app.messages import GhostState
from app.replay.open_loop import Loop, OpenLoop
from app.state import State
from app.tick import Inputs, Outputs

Minds = tuple[State, Loop | None]


class Mind:
    """One or two brains that are given the same Inputs, and their common state."""

    def __init__(self, brain: Brain, ghost: OpenLoop | None = None) -> None:
        self.brain, self.ghost = brain, ghost

    def tick(self, x: Inputs) -> tuple[Outputs, GhostState | None]:
        """What was decided; and what the ghost would have told the arm."""
        out = self.brain.tick(x)
        return out, self.ghost.tick(x, out) if self.ghost else None

    def capture(self) -> Minds:
        """The state of both."""
        return self.brain.capture(), self.ghost.capture() if self.ghost else None

    def restore(self, state: Minds) -> None:
        """Go on from a captured state."""
        own, other = state
        self.brain.restore(own)
        if self.ghost and other is not None:
            self.ghost.restore(other)
