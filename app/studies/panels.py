"""The paper's claim before its panels: the whole body stays farther away than sensor mounts do.

The same seed gives every controller the same sensors, so what is compared is their difference seed
by seed: steady true distance of the whole arm, mean over the last seconds of a run. The arm must
not arrive at its goal, which lies behind the plate, or on it.
"""

from collections.abc import Sequence

from msgspec.structs import replace

from app.errors import StudyError
from app.report import Check
from app.studies.case import Case, setup_of
from app.studies.comparisons import comparison_rows
from app.studies.conditions import Condition
from app.studies.experiment import Told
from app.studies.rows import grouped, row_of
from app.studies.settled import settled
from app.studies.trial import TrialResult, TrialSpec
from app.world.scene import find_scene, read_scene, scene_of
from app.world.tables import SceneTable

CONTROLLERS = ("S", "WB", "QP", "paper", "oracle")
PLATE = "plate"
FARTHER = 0.10  # [m] that the whole body stays farther away
FIRST = ("steady_m", "goal_error_m")
COMPARED = ("steady_m", "true_least_m", "goal_error_m", "jerk_rms")


def before_plate(
    spec: TrialSpec, c: Condition, scene: str, axis: int, plate: float = 0.0, goal: float = 0.0
) -> Case:
    """A trial in a scene with its plate and its goal moved by [m] along an axis of the base."""
    path = find_scene(scene)
    table = moved(read_scene(path), axis, plate, goal)
    built = scene_of(table, path, spec.seed)
    return Case(setup_of(spec, c, scene), c.params(), scene=built, more=settled)


def moved(table: SceneTable, axis: int, plate: float, goal: float) -> SceneTable:
    """The scene with its plate and its goal elsewhere."""
    if table.goal is None:
        raise StudyError("before a plate the arm needs a goal; give the scene one")
    bodies = tuple(
        replace(b, position_m=_along(b.position_m, axis, plate)) if b.name == PLATE else b
        for b in table.body
    )
    place = _along(table.goal.position_m, axis, goal)
    return replace(table, body=bodies, goal=replace(table.goal, position_m=place))


def _along(
    position: tuple[float, float, float], axis: int, by: float
) -> tuple[float, float, float]:
    x, y, z = (p + by * (i == axis) for i, p in enumerate(position))
    return x, y, z


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition, their differences, and the paper's claim of each place."""
    rows = [row_of(name, trials, FIRST) for name, trials in grouped(good).items()]
    differences = comparison_rows(good, COMPARED)
    checks = [
        Check(d["name"], d["mean"], "m", FARTHER, at_least=True)
        for d in differences
        if d["name"].startswith("WB") and d["name"].endswith("steady_m") and " - S" in d["name"]
    ]
    return Told([*rows, *differences], checks)
