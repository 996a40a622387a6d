"""All that other viewers are told of a run: topics and messages out of snapshots.

| topic                 | schema          | when                                     |
|-----------------------|-----------------|------------------------------------------|
| `/tf`                 | FrameTransforms | every picture: links, tool, bodies       |
| `/joint_states`       | JointStates     | every picture                            |
| `/goal`               | PoseInFrame     | every picture                            |
| `/points/<verdict>`   | PointCloud      | every picture, where there are any       |
| `/points/remembered`  | PointCloud      | every picture, where there are any       |
| `/pair`               | SceneUpdate     | every picture with a closest pair        |
| `/robot`              | SceneUpdate     | once                                     |
| `/arm/<link>`         | PointCloud      | once: the arm without meshes             |
| `/cell`               | SceneUpdate     | once, and when the ground sinks          |
| `/cell/learned`       | SceneUpdate     | when something is learned or forgotten   |
| `/obstacles`          | SceneUpdate     | when bodies come, go or look different   |
| `/log`                | Log             | at each change                           |
"""

from app.cell.parts import Cell
from app.messages import Snapshot
from app.record.views.clouds import CloudViews
from app.record.views.frames import FrameViews, base_frame
from app.record.views.pair import PairView
from app.record.views.things import ThingViews
from app.record.views.values import View
from app.record.views.words import LogView
from app.robot.model import Robot
from app.robot.skin import Skin


class Views:
    """What one file, or one server, tells; it remembers what was told, and is for one thread."""

    def __init__(self, robot: Robot, skin: Skin, cell: Cell) -> None:
        base = base_frame(robot)
        self._frames = FrameViews(robot)
        self._clouds = CloudViews(base, skin.slots)
        self._things = ThingViews(robot, cell, base)
        self._pair = PairView(base, robot.links)
        self._words = LogView()

    def of(self, snapshot: Snapshot, at_ns: int) -> list[View]:
        """A picture: every topic that has something to tell; the first call tells the meshes too.

        at_ns: [ns] since 1970, the messages' time. Meant for 15 to 30 calls a second.
        """
        s = snapshot
        parts = (self._frames, self._things, self._clouds, self._pair, self._words)
        return [view for part in parts for view in part.of(s, at_ns)]

    def log(self, snapshot: Snapshot, at_ns: int) -> list[View]:
        """Only what is said to people: for the ticks between two pictures, it costs next to
        nothing."""
        return self._words.of(snapshot, at_ns)
