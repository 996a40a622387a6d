"""A robot folder for a URDF: what `flinch new-robot` writes, to be edited by a person.

OUT/robot.toml, OUT/NAME.urdf with its meshes in OUT/meshes, OUT/skin/rings.toml. It is written
beside OUT first and read back, so that OUT either works or is not there.
"""

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.errors import RobotError, options
from app.messages import Array
from app.robot.draft_text import Ring, layout_text, robot_text
from app.robot.draft_urdf import copy_urdf
from app.robot.model import Robot, load_robot, load_urdf
from app.robot.roundness import Stretch, across, circle, round_stretch
from app.robot.skin_file import load_skin
from app.robot.tables import Bodies, Choice

LENS = 0.0173  # [m] of a lens above its link: room for a sensor's board in a cover, as on the UR10e
SHORTEST = 0.046  # [m] of a round stretch: the width of a cover
BEND = 0.5  # [rad] that a joint may be bent from the middle of its limits to find a home
TRIES = 200  # postures looked at for a home
LOW = 0.1  # [m] above the plane that the base stands on

HINT = {"collision": " (if its visual mesh is, add --bodies visual)", "visual": ""}


class Wish(NamedTuple):
    """`sensors` of them round a link."""

    link: str
    sensors: int


def parse_wish(text: str) -> Wish:
    """LINK:COUNT as a person writes it."""
    link, _, count = text.rpartition(":")
    if not link or not count.isdecimal() or not 1 <= int(count) <= 100:
        raise RobotError(f"ring {text!r}; give LINK:COUNT with 1 to 100 sensors, such as link3:8")
    return Wish(link, int(count))


def write_draft(
    urdf: Path, wishes: Sequence[Wish], out: Path, bodies: Bodies = "collision"
) -> tuple[Robot, list[Ring]]:
    """Write the folder `out`; the robot in it, and its rings, which go round `bodies`.

    Raises `RobotError` where `out` is there already or something cannot be used; nothing is
    written then.
    """
    if out.exists():
        raise RobotError(f"{out}: is there already; give another --out, or take it away first")
    if not wishes:
        raise RobotError("no ring was asked for; give --ring LINK:COUNT, once or several times")
    robot = load_urdf(urdf, Choice(bodies=bodies))
    rings = [
        r for link in dict.fromkeys(w.link for w in wishes) for r in _rings(link, wishes, robot)
    ]
    out.parent.mkdir(parents=True, exist_ok=True)
    fresh = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    try:
        file = copy_urdf(urdf, robot.description, fresh)
        home = bent_home(robot)
        (fresh / "robot.toml").write_text(robot_text(robot, file.name, home), "utf-8")
        (fresh / "skin").mkdir()
        (fresh / "skin/rings.toml").write_text(layout_text(rings, LENS), "utf-8")
        written = load_robot(fresh)
        assert written.layout is not None
        load_skin(written.layout, written)
        fresh.chmod(0o755)  # it was made for one person's eyes
        fresh.rename(out)
    except BaseException:
        shutil.rmtree(fresh)
        raise
    return load_robot(out), rings


def _rings(link: str, wishes: Sequence[Wish], robot: Robot) -> list[Ring]:
    """The rings of one link, evenly along its round stretch; every second one turned by half."""
    counts = [w.sensors for w in wishes if w.link == link]
    stretch, body = _stretch(link, robot), robot.bodies[robot.link_index(link)]
    room = int(stretch.length / SHORTEST)
    if len(counts) > room:
        raise RobotError(
            f"link {link!r} is round for {1e3 * stretch.length:.0f} mm, which has room for {room} "
            f"rings with covers; ask for fewer than {len(counts)}"
        )
    name, out = link.removesuffix("_link"), []
    for i, count in enumerate(counts):
        near = stretch.low + (i + 0.5) / len(counts) * (stretch.high - stretch.low)
        cut = circle(body, near, stretch.axis)
        centre, radius = cut or (near, stretch.radius)
        u, v = across(stretch.axis)
        turn = np.pi / count * (i % 2)
        out.append(
            Ring(
                name=f"{name}-{i + 1}" if len(counts) > 1 else name,
                link=link,
                centre=centre,
                axis=stretch.axis,
                start=np.cos(turn) * u + np.sin(turn) * v,
                radius=radius + LENS,
                sensors=count,
            )
        )
    return out


def _stretch(link: str, robot: Robot) -> Stretch:
    """Where a ring may sit on a link, from the joint that moves it outwards."""
    moving = [name for name, s in zip(robot.links, robot.supports, strict=True) if s.any()]
    if link not in robot.description.links:
        raise RobotError(f"{robot.name} has no link {link!r}; {options(link, moving)}")
    if link not in robot.links:
        raise RobotError(f"link {link!r} has no shape; {options(link, moving)}")
    if link not in moving:
        raise RobotError(
            f"link {link!r} is fixed to the base: a ring on it moves with nothing; "
            f"{options(link, moving)}"
        )
    found = round_stretch(robot.bodies[robot.link_index(link)])
    if found is None or found.length < SHORTEST:
        round_ = [name for name in moving if _is_round(robot, name)]
        raise RobotError(
            f"link {link!r} is not round for {1e3 * SHORTEST:.0f} mm anywhere, so no ring fits "
            f"round it{HINT[robot.description.bodies]}; {options(link, round_)}"
        )
    if found.low @ found.low > found.high @ found.high:  # its frame is at the joint
        found = Stretch(found.high, found.low, found.radius)
    return found


def _is_round(robot: Robot, link: str) -> bool:
    found = round_stretch(robot.bodies[robot.link_index(link)])
    return found is not None and found.length >= SHORTEST


def bent_home(robot: Robot) -> Array:
    """(n,) a posture near the middle of the limits from which the tool can go anywhere.

    Of some postures round the middle it is the one in which the slowest direction of the tool is
    fastest, the least singular value of its Jacobian for places largest; none of them hangs lower
    than `LOW` or than the middle does.
    """
    rng = np.random.default_rng(0)
    room = np.minimum(BEND, 0.4 * (robot.q_max - robot.q_min))
    floor = min(LOW, _lowest(robot, robot.home))
    best, most = robot.home, -np.inf
    for q in (robot.home, *(robot.home + rng.uniform(-room, room, (TRIES, robot.n)))):
        least = float(np.linalg.svd(robot.posture(q).tool_jacobian()[:3], compute_uv=False)[-1])
        if least > most + 1e-6 and _lowest(robot, q) >= floor:
            best, most = q, least
    return best


def _lowest(robot: Robot, q: Array) -> float:
    """[m] of what moves above the base's x-y plane, by the boxes round the links."""
    posture, lowest = robot.posture(q), np.inf
    for i in np.flatnonzero(robot.supports.any(axis=1)):
        T, box = posture.T_base_link[i], robot.rigid[i].box
        middle, half = box.mean(axis=0), np.ptp(box, axis=0) / 2.0
        lowest = min(lowest, float(T[2, :3] @ middle + T[2, 3] - np.abs(T[2, :3]) @ half))
    return lowest
