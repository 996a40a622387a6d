"""What to build, by name: what a command line or a test asks for, checked as far as names go."""

from dataclasses import dataclass
from ipaddress import IPv6Address
from pathlib import Path

from app.errors import ConfigError
from app.robot.tables import AS_IT_IS, Choice
from app.sensing.budget import read_budget
from app.world.people import check_people

SIMULATED = "simulated"


@dataclass(frozen=True)
class Setup:
    """What to build, by name; the command line and the tests fill it in."""

    robot: str = "ur10e"
    skin: str = ""  # a layout's name or path; empty: the robot's own
    scene: str = "cell"
    cell: str = ""  # the known static place, by name or path; empty: the scene's
    person: str = ""  # who is there instead of the scene's people: 'none', 'bvh:FILE[@X,Y,HEADING]'
    sensors: str = "simulated"  # or replay:PATH[@SENSOR], serial:PORT, each with +simulated
    rate: float = 250.0
    seed: int = 0
    program: str = ""  # a waypoint program's name or path, run from the start
    ghost: str = ""  # a second controller's mode, on a simulated arm of its own
    urdf: str = ""  # a bare URDF instead of a robot's folder
    choice: Choice = AS_IT_IS  # tool, home posture, meshes to measure to
    background: Path | None = None  # file of the learned background, read and written
    ranges: Path | None = None  # table of the zones' range errors
    mounts: Path | None = None  # overlay on the layout: where the sensors really sit
    stray: float = 0.0  # share of zones and frames with a return from nothing
    driver: str = SIMULATED  # or ur:HOST
    armed: bool = False  # may a real arm be moved? only watched otherwise
    world: str = "honest"  # or ideal, each with single parts: honest,mounting=0 (`Budget`)
    apart: bool = False  # compute simulated frames in a process of their own: with a page

    def __post_init__(self) -> None:
        if not 50.0 <= self.rate <= 500.0:
            raise ConfigError(f"rate = {self.rate:g} Hz; give a value from 50 to 500")
        if self.seed < 0:
            raise ConfigError(f"seed = {self.seed}; give a whole number from 0")
        read_budget(self.world)
        check_people(self.person)
        if self.armed and not self.cell:
            raise ConfigError(
                "--arm needs to know the cell, or the arm takes its own table for free space; "
                "write one (static_assets/cells/table.toml shows how) and give --cell FILE"
            )
        _check_driver(self)


def driver_host(driver: str) -> str:
    """The host of a driver `ur:HOST`, without the brackets of an IPv6 address."""
    return driver.removeprefix("ur:").removeprefix("[").removesuffix("]")


def _is_ipv6(host: str) -> bool:
    try:
        IPv6Address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


def _check_driver(setup: Setup) -> None:
    """ConfigError for an arm that there is no driver for, or that is asked for by halves."""
    kind, _, host = setup.driver.partition(":")
    if setup.driver == SIMULATED:
        if setup.armed:
            raise ConfigError("--arm belongs to a real arm; add --driver ur:HOST")
    elif kind != "ur" or not host or (":" in host and not _is_ipv6(host)):
        raise ConfigError(
            f"driver = {setup.driver!r}; give 'simulated' or 'ur:HOST' (a UR's ports are fixed; "
            "an IPv6 address may stand in brackets)"
        )
    elif setup.choice.home_deg:
        raise ConfigError("a real arm begins where it stands; leave --home-deg or --driver out")
