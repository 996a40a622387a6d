"""Where everything is: one frame a link, the tool, one frame a body; and the joints' values.

Viewers hang what they draw on frames, so that meshes are told once and only frames move.
"""

from collections.abc import Iterable

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from app.messages import Array, BodyPose, Snapshot
from app.record.views.values import Fields, View, pose_of, time_of, turn_of, vector_of
from app.robot.model import Robot

TOOL = "tool"


def base_frame(robot: Robot) -> str:
    """The name of the frame that all others are in; no link of the arm has it."""
    return "base" if "base" not in robot.links else "arm_base"


def body_frame(name: str) -> str:
    """The frame of a simulated body."""
    return f"obstacle/{name}"


class FrameViews:
    """`/tf`, `/joint_states` and `/goal` of one robot."""

    def __init__(self, robot: Robot) -> None:
        self._base, self._links, self._joints = base_frame(robot), robot.links, robot.joints

    def of(self, s: Snapshot, at_ns: int) -> list[View]:
        """All three, at `at_ns` since 1970."""
        stamp = time_of(at_ns)
        placed = [self._frame(name, T, stamp) for name, T in self._poses(s)]
        q, qd = s.joints.q.tolist(), s.joints.qd.tolist()
        joints: list[Fields] = [
            {"name": name, "position": p, "velocity": v}
            for name, p, v in zip(self._joints, q, qd, strict=True)
        ]
        goal = pose_of(s.goal.T_base_tool)
        return [
            ("/tf", FrameTransforms(transforms=placed)),
            ("/joint_states", JointStates(timestamp=stamp, joints=joints)),
            ("/goal", PoseInFrame(timestamp=stamp, frame_id=self._base, pose=goal)),
        ]

    def _poses(self, s: Snapshot) -> Iterable[tuple[str, Array]]:
        yield from zip(self._links, s.T_base_link, strict=True)
        yield TOOL, s.T_base_tool
        yield from map(_placed, s.world)

    def _frame(self, name: str, T: Array, stamp: Fields) -> Fields:
        return {
            "timestamp": stamp,
            "parent_frame_id": self._base,
            "child_frame_id": name,
            "translation": vector_of(T[:3, 3]),
            "rotation": turn_of(T),
        }


def _placed(body: BodyPose) -> tuple[str, Array]:
    return body_frame(body.view.name), body.T_base_body
