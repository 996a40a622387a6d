"""X1: a rigid plate ahead of the tool, nearer and farther, with the goal behind it and on it."""

from app.studies.case import Case
from app.studies.conditions import Condition
from app.studies.experiment import Experiment, register
from app.studies.panels import COMPARED, CONTROLLERS, before_plate, told
from app.studies.trial import TrialSpec

AHEAD = 0  # axis of the base
# [m] by which plate and goal are moved: in the scene they are 0.40 m and 0.45 m ahead
VARIANTS = {
    "0.40": (0.0, 0.0), "0.40-on": (0.0, -0.05), "0.55": (0.15, 0.15), "0.55-on": (0.15, 0.10),
}  # fmt: skip


def case(spec: TrialSpec, c: Condition) -> Case:
    """The plate ahead, as far as the variant says."""
    return before_plate(spec, c, "front-panel", AHEAD, *VARIANTS[c.variant])


register(
    Experiment(
        "front-panel", "A plate ahead of the tool, and the goal behind it or on it.",
        CONTROLLERS, 10, 10.0, case, told, variants=tuple(VARIANTS),
        looked_at=COMPARED,
    )
)  # fmt: skip
