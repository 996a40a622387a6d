"""Each topic's schema, and how it is handed to a reader that has never heard of it."""

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap_protobuf.schema import build_file_descriptor_set

from app.record.views.clouds import REMEMBERED_TOPIC, TOPICS
from app.record.views.surface import surface_topic
from app.robot.model import Robot

SCHEMAS: dict[str, type] = {  # whatever the robot
    "/tf": FrameTransforms,
    "/joint_states": JointStates,
    "/goal": PoseInFrame,
    "/log": Log,
    **dict.fromkeys(("/robot", "/cell", "/cell/learned", "/obstacles", "/pair"), SceneUpdate),
    **dict.fromkeys((*TOPICS.values(), REMEMBERED_TOPIC), PointCloud),
}


def schemas_of(robot: Robot) -> dict[str, type]:
    """Of all topics that a robot's views may have."""
    return SCHEMAS | {surface_topic(link): PointCloud for link in robot.links}


def schema_name(message: type) -> str:
    """By which viewers know it."""
    return f"foxglove.{message.__name__}"


def schema_bytes(message: type) -> bytes:
    """A `FileDescriptorSet` of it and of all that it is made of."""
    data: bytes = build_file_descriptor_set(message).SerializeToString()
    return data
