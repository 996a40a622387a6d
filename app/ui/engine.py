"""What the page needs of an engine: values to look at, and one way back in."""

from typing import Protocol

from app.actions import Action
from app.cell.parts import Cell
from app.messages import Snapshot
from app.robot.model import Robot
from app.robot.skin import Skin
from app.timing import Latest


class Engine(Protocol):
    """The running arm as an onlooker sees it; `post` is thread-safe and returns at once."""

    @property
    def robot(self) -> Robot: ...
    @property
    def skin(self) -> Skin: ...
    @property
    def snapshots(self) -> Latest[Snapshot]: ...
    @property
    def source(self) -> str: ...  # where the frames come from, in words
    @property
    def editable(self) -> bool: ...  # is there a simulated world that people may change?
    @property
    def scene(self) -> str: ...
    @property
    def programs(self) -> tuple[str, ...]: ...  # waypoint programs by name
    @property
    def cell(self) -> Cell: ...
    def post(self, action: Action) -> None: ...
