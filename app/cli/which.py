"""The flags that choose a robot and its skin."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from app.robot.tables import Bodies, Choice

if TYPE_CHECKING:  # the parts of an engine take a while to load, which --help need not wait for
    from app.setup import Setup


@dataclass(frozen=True, kw_only=True)
class WhichRobot:
    """The flags that choose a robot; every command that takes one has the same."""

    robot: str = "ur10e"
    """A robot's name, the path of its folder, or robot_descriptions:NAME."""
    urdf: str = ""
    """A bare URDF file instead, with its own meshes; give it a --skin."""
    skin: str = ""
    """A sensor layout's name or path; default: the robot's own."""
    tool: str = ""
    """A tool of the robot, a tool's TOML file, a link of the URDF as tool frame, or 'none'."""
    home_deg: tuple[float, ...] = ()
    """Posture to begin in [degrees, mm for a sliding joint], one value a joint."""
    bodies: Bodies | None = None
    """Meshes of the URDF that distances are measured to; default: the robot's own choice, else
    collision."""

    def setup(self, **facts: Any) -> "Setup":
        """What to build with this robot; `facts` are the other fields of a `Setup`."""
        from app.setup import Setup

        choice = Choice(self.tool, self.home_deg, self.bodies)
        return Setup(self.robot, self.skin, urdf=self.urdf, choice=choice, **facts)
