"""The closest pair: a line and an arrow from the world's point to the robot's, and the distance."""

from math import sqrt

from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from app.colours import activation_colour
from app.messages import Array, Snapshot
from app.record.views.things import entity, whole
from app.record.views.values import Fields, View, colour_of, vector_of

THICK, HEAD = 0.012, 0.04  # [m] of the arrow's shaft, and of its head's length
LETTERS = 0.05  # [m]
UPRIGHT = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
SHORT = 1e-3  # [m]: less has no direction to draw


class PairView:
    """`/pair`; told as empty once when nothing is near."""

    def __init__(self, base: str, links: tuple[str, ...]) -> None:
        self._base, self._links = base, links
        self._shown = True  # so that the first one clears what may stand there

    def of(self, s: Snapshot, at_ns: int) -> list[View]:
        """The pair that the avoidance looks at, coloured by how far it acts."""
        i = s.pairs.closest
        if i < 0:
            gone, self._shown = self._shown, False
            return [("/pair", whole((), at_ns))] if gone else []
        self._shown = True
        world, robot = s.pairs.on_world[i], s.pairs.on_robot[i]
        colour = colour_of(activation_colour(s.command.activation))
        words = f"{100.0 * s.pairs.distance[i]:.0f} cm {self._links[int(s.pairs.link[i])]}"
        text = {
            "pose": {"position": vector_of(world), "orientation": UPRIGHT},
            "billboard": True, "font_size": LETTERS, "color": colour, "text": words,
        }  # fmt: skip
        arrow = _arrow(world, robot, s.pairs.normal[i], colour)
        update: SceneUpdate = whole(
            [entity("closest", self._base, at_ns, arrows=[arrow], texts=[text])], at_ns
        )
        return [("/pair", update)]


def _arrow(begin: Array, end: Array, normal: Array, colour: Fields) -> Fields:
    """An `ArrowPrimitive`: along the x axis of its pose."""
    way = end - begin
    length = sqrt(float(way @ way))
    if length < SHORT:
        way, length = normal * SHORT, SHORT
    head = min(HEAD, 0.5 * length)
    return {
        "pose": {"position": vector_of(begin), "orientation": _turn(way / length)},
        "shaft_length": length - head, "shaft_diameter": THICK,
        "head_length": head, "head_diameter": 2.5 * THICK, "color": colour,
    }  # fmt: skip


def _turn(x: Array) -> Fields:
    """A `Quaternion` that turns the x axis to the unit vector `x` (3,) the short way."""
    a, b, c = x.tolist()
    if a < -1.0 + 1e-9:  # straight back: any half turn will do
        return {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0}
    size = sqrt(2.0 + 2.0 * a)
    return {"x": 0.0, "y": -c / size, "z": b / size, "w": size / 2.0}
