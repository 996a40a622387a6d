"""X2: a rigid plate beside the forearm, on the left and on the right, and the goal behind it."""

from app.studies.case import Case
from app.studies.conditions import SIDES, Condition
from app.studies.experiment import Experiment, register
from app.studies.panels import COMPARED, CONTROLLERS, before_plate, told
from app.studies.trial import TrialSpec

ASIDE = 1  # axis of the base
SCENES = {"left": "side-panel", "right": "side-panel-right"}


def case(spec: TrialSpec, c: Condition) -> Case:
    """The plate on the condition's side."""
    return before_plate(spec, c, SCENES[c.side], ASIDE)


register(
    Experiment(
        "side-panel", "A plate beside the forearm, left or right, and the goal behind it.",
        tuple(c + side for c in CONTROLLERS for side in SIDES), 10, 10.0, case, told, sides=True,
        looked_at=COMPARED,
    )
)  # fmt: skip
