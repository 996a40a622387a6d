"""`flinch doctor`: examine a robot."""

from dataclasses import dataclass, replace

import tyro

from app.cli.interrupt import end_at_once
from app.cli.which import WhichRobot


@dataclass(frozen=True)
class Doctor(WhichRobot):
    """Examine a robot: inertias, limits, meshes, sensors, self-intersections, frames.

    Ends with 1 when something is missed."""

    name: tyro.conf.Positional[str] = ""
    """The same as --robot, which may then be left out."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> int:
        from app.checks.doctor import examine, to_table
        from app.choices import build_robot, choose_skin

        end_at_once()
        setup = replace(self, robot=self.name or self.robot).setup()
        robot = build_robot(setup)
        skin = choose_skin(setup, robot) if robot.layout else None
        report = examine(robot, skin)
        print(report.to_json() if self.json else to_table(report))
        return 0 if all(check.ok for check in report.checks) else 1
