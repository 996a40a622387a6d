"""Our values as the schemas write them: plain dictionaries, which their messages take."""

from typing import Any

from app.colours import RGB
from app.messages import Array
from app.poses import quaternion

SECOND = 1_000_000_000  # [ns]
Fields = Any  # a message's fields by name: its constructor takes them, its stubs know only messages
View = tuple[str, Any]  # a topic and its message


def time_of(at_ns: int) -> Fields:
    """A `Timestamp` of nanoseconds since 1970."""
    seconds, nanos = divmod(at_ns, SECOND)
    return {"seconds": seconds, "nanos": nanos}


def vector_of(v: Array) -> Fields:
    """A `Vector3` or a `Point3` of (3,)."""
    x, y, z = v.tolist()
    return {"x": x, "y": y, "z": z}


def turn_of(T: Array) -> Fields:
    """A `Quaternion` of a pose (4, 4)."""
    w, x, y, z = quaternion(T)
    return {"x": x, "y": y, "z": z, "w": w}


def pose_of(T: Array) -> Fields:
    """A `Pose` of (4, 4)."""
    return {"position": vector_of(T[:3, 3]), "orientation": turn_of(T)}


def colour_of(colour: RGB, opacity: float = 1.0) -> Fields:
    """A `Color` of 0..255."""
    r, g, b = (c / 255.0 for c in colour)
    return {"r": r, "g": g, "b": b, "a": opacity}
