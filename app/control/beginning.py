"""What a person should know of a posture that the arm begins in: how near it is to the cell."""

from app.cell.parts import Cell
from app.control.clearance import Clearance
from app.control.gaps import KEPT
from app.messages import Array
from app.robot.model import Robot

NEAR = 0.01  # [m] what begins farther away needs no words


def warnings(robot: Robot, cell: Cell, q: Array | None = None) -> tuple[str, ...]:
    """One line for each link and part of the cell that begin `NEAR`, the nearest first.

    q: (n,) the posture, the robot's home if not given. No bound is left out for it: what begins
    nearer than the distance that is kept is led away as soon as the arm may move.
    """
    gaps = Clearance(robot, cell).measure(robot.posture(robot.home if q is None else q), NEAR)
    nearest: dict[tuple[int, int], float] = {}
    for link, part, distance in zip(gaps.a, gaps.part, gaps.distance, strict=True):
        if part >= 0:
            pair = (int(link), int(part))
            nearest[pair] = min(nearest.get(pair, NEAR), float(distance))
    return tuple(
        _words(robot.links[link], cell.names[part], distance)
        for (link, part), distance in sorted(nearest.items(), key=lambda item: item[1])
    )


def _words(link: str, part: str, distance: float) -> str:
    name, where = link.removesuffix("_link"), f"{abs(distance) * 100:.1f} cm"
    place = f"{where} from {part!r}" if distance > 0.0 else f"{where} inside {part!r}"
    after = "; it moves away first" if distance < KEPT else ""
    return f"{name} begins {place}{after}"
