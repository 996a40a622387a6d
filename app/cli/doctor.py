"""`flinch doctor`: examine a robot."""

from dataclasses import dataclass

import tyro

from app.cli.which import WhichRobot


@dataclass(frozen=True)
class Doctor(WhichRobot):
    """Examine a robot: inertias, limits, meshes, sensors, self-intersections, frames."""

    robot: tyro.conf.Positional[str] = "ur10e"
    """A robot's name, the path of its folder, or robot_descriptions:NAME."""
    skin: str = ""
    """A sensor layout's name or path; default: the robot's own, if it has one."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.checks.doctor import examine, to_table
        from app.wiring import Setup, build_robot, choose_skin

        setup = Setup(self.robot, self.skin, urdf=self.urdf, choice=self.choice())
        robot = build_robot(setup)
        skin = choose_skin(setup, robot) if self.skin or robot.skin else None
        report = examine(robot, skin)
        print(report.to_json() if self.json else to_table(report))
