"""What is known of the quadratic programme's controllers."""

from math import inf
from typing import TYPE_CHECKING

from app.config import Params
from app.control.registry import OF_SEPARATION, controller
from app.needs import Needs

if TYPE_CHECKING:  # `--help` reads this file and must not wait for what a controller is made of
    from app.control.clearance import Clearance
    from app.control.qp_controller import QpController
    from app.robot.model import Robot


BOUNDS = frozenset({"retreat_speed", "slide_along", "bounds_first"}) | OF_SEPARATION


def bounds_needs(params: Params) -> Needs:
    """Several pairs a link, up to where avoidance begins; for the separation all."""
    reach = inf if params.separation else params.avoidance_begins
    return Needs("several", reach)


def separation_needs(params: Params) -> Needs:
    """All pairs there are."""
    return Needs("several", inf)


def bounds_distances(params: Params) -> tuple[float, float]:
    """[m] that is kept, and from which on pairs are bounds."""
    return params.distance_kept, params.avoidance_begins


@controller(
    "qp", "Whole body, bounds (QP)", "every near pair as a bound of a quadratic programme",
    needs=bounds_needs, distances=bounds_distances,
    knows_cell=True,
    uses=BOUNDS | {"distance_kept", "avoidance_begins", "separation"},
)  # fmt: skip
def bounds(robot: "Robot", clearance: "Clearance") -> "QpController":
    """The default."""
    from app.control.qp_controller import QpController

    return QpController(robot, clearance)


@controller(
    "ssm", "Slow and stop only (SSM)", "slows and stops by speed and separation, gives no way",
    needs=separation_needs, distances=lambda params: None,
    knows_cell=True, studies=frozenset(), uses=BOUNDS | {"distance_kept"},
)  # fmt: skip
def slow_and_stop(robot: "Robot", clearance: "Clearance") -> "QpController":
    """The baseline of a fence."""
    from app.control.qp_controller import QpController

    return QpController(robot, clearance, gives_way=False)
