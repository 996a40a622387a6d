"""Undo and redo of goals and bodies: an engine that remembers how to take back what passes it.

Of a drag, which is many moves, only its whole way is one step. What others change meanwhile is not
looked at: a step back puts a body where it was before that step.
"""

from dataclasses import dataclass

from app.actions import Action, AddObstacle, MoveObstacle, RemoveObstacle, SetGoal, SetPose
from app.messages import Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.world.saving import Added

MOST = 100  # steps that are remembered
TOGETHER = 1.0  # [s] moves of one thing that follow each other faster are one step


@dataclass
class _Step:
    """back, forth: what takes it back, and what does it again.   what: is moved.   at: [s]."""

    what: str
    back: list[Action]
    forth: list[Action]
    at: float


class Undo:
    """An `Engine` for whatever moves goals and bodies."""

    def __init__(self, engine: Engine, clock: Clock) -> None:
        self.robot, self.skin, self.snapshots = engine.robot, engine.skin, engine.snapshots
        self.source, self.editable, self.scene = engine.source, engine.editable, engine.scene
        self.programs, self.cell = engine.programs, engine.cell
        self._engine, self._clock = engine, clock
        self._snapshot: Snapshot | None = None
        self._shapes: dict[str, AddObstacle] = {}  # how each body came that was added here
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    def see(self, snapshot: Snapshot) -> None:
        """The newest snapshot."""
        self._snapshot = snapshot

    def post(self, action: Action) -> None:
        """Post it, and remember how to take it back if it moves a goal or a body."""
        step = self._step(action)
        if step is not None:
            self._note(step)
        if isinstance(action, AddObstacle):
            self._shapes[action.name] = action
        self._engine.post(action)

    def added(self) -> list[Added]:
        """The bodies that were added here and are still there."""
        world = self._snapshot.world if self._snapshot is not None else ()
        return [
            Added(p.view.name, self._shapes[p.view.name].shape, p.T_base_body)
            for p in world
            if p.view.name in self._shapes
        ]

    def undo(self) -> None:
        """Take the last step back, if there is one."""
        self._move(self._done, self._undone, back=True)

    def redo(self) -> None:
        """Do again what was taken back last, if nothing else was done since."""
        self._move(self._undone, self._done, back=False)

    def _move(self, source: list[_Step], target: list[_Step], back: bool) -> None:
        if source:
            step = source.pop()
            step.at = float("-inf")  # nothing joins it any more
            target.append(step)
            for action in step.back if back else step.forth:
                self._engine.post(action)

    def _note(self, step: _Step) -> None:
        self._undone.clear()
        last = self._done[-1] if self._done else None
        joins = last is not None and step.what and last.what == step.what
        if last is not None and joins and step.at - last.at < TOGETHER:
            last.forth, last.at = step.forth, step.at
            return
        self._done.append(step)
        del self._done[:-MOST]

    def _step(self, action: Action) -> _Step | None:
        now, at = self._snapshot, self._clock.now()
        if now is None:
            return None
        match action:
            case SetGoal() | SetPose():
                before = SetGoal(now.goal.T_base_tool)
                return _Step("the goal", [before], [action], at)
            case AddObstacle(name=name):
                return _Step("", [RemoveObstacle(name)], [action], at)
            case MoveObstacle(name=name):
                T = next((p.T_base_body for p in now.world if p.view.name == name), None)
                back: list[Action] = [] if T is None else [MoveObstacle(name, T)]
                return _Step(f"body {name}", back, [action], at) if back else None
            case RemoveObstacle(name=name) if name in self._shapes:
                T = next((p.T_base_body for p in now.world if p.view.name == name), None)
                if T is not None:
                    again: list[Action] = [self._shapes[name], MoveObstacle(name, T)]
                    return _Step("", again, [action], at)
        return None
