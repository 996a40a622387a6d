"""The flags that choose a robot."""

from dataclasses import dataclass

from app.robot.tables import Bodies, Choice


@dataclass(frozen=True)
class WhichRobot:
    """The flags that choose a robot; every command that takes one has the same."""

    robot: str = "ur10e"
    """A robot's name, the path of its folder, or robot_descriptions:NAME."""
    urdf: str = ""
    """A bare URDF file instead, with its own meshes; give it a --skin."""
    tool: str = ""
    """A tool of the robot, a tool's TOML file, a link of the URDF as tool frame, or 'none'."""
    home_deg: tuple[float, ...] = ()
    """Posture to begin in [degrees, mm for a sliding joint], one value a joint."""
    bodies: Bodies = "collision"
    """Meshes of the URDF that distances are measured to."""

    def choice(self) -> Choice:
        """What was chosen beside the robot itself."""
        return Choice(self.tool, self.home_deg, self.bodies)
