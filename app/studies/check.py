"""What is wrong with a study is said before its first trial, and not by every trial."""

from app.choices import build_robot
from app.studies.experiment import experiment_of
from app.studies.study import Study


def check_study(study: Study) -> None:
    """FlinchError for a condition, a world or a layout that there is not."""
    kind = experiment_of(study.experiment)
    specs = study.specs()
    if kind.case is None or kind.check is not None:
        return  # its conditions are its own
    worn = set()
    for spec in {s.condition: s for s in specs}.values():
        setup = kind.case(spec, kind.read(spec.condition)).setup
        if setup.skin and (setup.robot, setup.skin) not in worn:
            worn.add((setup.robot, setup.skin))
            build_robot(setup)
