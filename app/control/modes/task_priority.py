"""What is known of the paper's controller and its kin."""

from typing import TYPE_CHECKING

from app.config import Params
from app.control.registry import controller, fading_distances
from app.needs import Needs

if TYPE_CHECKING:  # `--help` reads this file and must not wait for what a controller is made of
    from app.control.clearance import Clearance
    from app.control.task_priority_controller import TaskPriorityController
    from app.robot.model import Robot


USES = frozenset({"distance_kept", "limits_first", "position_first"})


def mounts(params: Params) -> Needs:
    """The closest pair of every sensor's mount."""
    return Needs("mounts", fading_distances(params)[1])


def published(params: Params) -> Needs:
    """The closest pair of every link, perceived as the paper does."""
    return Needs("links", fading_distances(params)[1], as_published=True)


@controller(
    "wb", "Whole body, closest (WB)", "the closest point of the body first, the goal second",
    memory=(False, True), uses=USES,
)  # fmt: skip
def whole_body(robot: "Robot", clearance: "Clearance") -> "TaskPriorityController":
    """The paper's method with a cap, with what moves, and on steadied pairs."""
    from app.control.task_priority_controller import TaskPriorityController

    return TaskPriorityController(robot)


@controller(
    "sm", "Sensor mounts (SM)", "as wb, but only the sensors' mounting points give way",
    needs=mounts, memory=(False,), studies=frozenset({"worlds"}), uses=USES,
)  # fmt: skip
def sensor_mounts(robot: "Robot", clearance: "Clearance") -> "TaskPriorityController":
    """The paper's baseline."""
    from app.control.task_priority_controller import TaskPriorityController

    return TaskPriorityController(robot)


@controller(
    "multi", "Whole body, every link", "as wb, with a row for every near link",
    studies=frozenset({"tradeoff"}), uses=USES,
)  # fmt: skip
def every_link(robot: "Robot", clearance: "Clearance") -> "TaskPriorityController":
    """No single closest pair that can jump."""
    from app.control.task_priority_controller import TaskPriorityController

    return TaskPriorityController(robot, every_link=True)


@controller(
    "paper", "As published (WB)", "as wb, strictly as published: one ray a zone, no memory, no cap",
    needs=published, memory=(False,), studies=frozenset({"tradeoff"}), uses=USES,
)  # fmt: skip
def paper(robot: "Robot", clearance: "Clearance") -> "TaskPriorityController":
    """Nothing that the paper does not have, in the controller or before it."""
    from app.control.task_priority_controller import TaskPriorityController

    return TaskPriorityController(robot, published=True)
