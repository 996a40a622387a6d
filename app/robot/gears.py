"""Joints that follow another one, as a URDF's <mimic> says: q = multiplier * q_master + offset.

They stay joints of the model, with values of their own, so that links, poses and recordings know
them. What may be chosen is the master's velocity alone: a rate that the follower would have goes
into the master's column, its own column is zero, and its velocity is made from the master's.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array, freeze


@dataclass(frozen=True, eq=False, slots=True)
class Gears:
    """Of n joints: q = times * q[into] + offset, which of one that follows none is q itself.

    into: (n,) the joint that each follows, itself for most.   times: (n,).   offset: (n,) [rad, m].
    """

    into: NDArray[np.int64]
    times: Array
    offset: Array

    @property
    def own(self) -> NDArray[np.bool_]:
        """(n,) joints that follow none."""
        return np.asarray(self.into == np.arange(len(self.into)))

    def place(self, q: Array) -> Array:
        """(n,) joint positions with each follower where its master has it."""
        return np.asarray(self.times * q[self.into] + self.offset)

    def speed(self, qd: Array) -> Array:
        """(n,) joint velocities with each follower as fast as its master makes it."""
        return np.asarray(self.times * qd[self.into])

    def spread(self, values: Any, fill: float) -> Any:
        """One value a joint from one for each that follows none, as a table may give them."""
        own = self.own
        if len(values) != own.sum():
            return values
        out = np.full(len(own), fill)
        out[own] = values
        return out.tolist()


class _Follows(NamedTuple):
    """One <mimic>."""

    master: str
    times: float
    offset: float


def no_gears(joints: int) -> Gears:
    """Every joint is its own master."""
    return Gears(
        freeze(np.arange(joints)), freeze(np.ones(joints)), freeze(np.zeros(joints))
    )  # fmt: skip


def read_gears(root: Element, joints: tuple[str, ...], urdf: Path) -> Gears:
    """The gears of a URDF; a follower of a follower follows the first master."""
    known = {
        j.get("name", ""): _read(j, joints, urdf)
        for j in root.findall("joint")
        if j.find("mimic") is not None and j.get("name") in joints
    }
    into, times, offset = np.arange(len(joints)), np.ones(len(joints)), np.zeros(len(joints))
    for i, name in enumerate(joints):
        at, steps = name, 0
        while at in known:
            f = known[at]
            offset[i] += times[i] * f.offset
            times[i] *= f.times
            at, steps = f.master, steps + 1
            if steps > len(known):
                raise RobotError(f"{urdf}: joint {name!r} follows itself; mend its <mimic>")
        into[i] = joints.index(at)
    return Gears(freeze(into), freeze(times), freeze(offset))


def _read(joint: Element, joints: tuple[str, ...], urdf: Path) -> _Follows:
    mimic, name = joint.find("mimic"), joint.get("name")
    assert mimic is not None
    master = mimic.get("joint", "")
    if master not in joints:
        raise RobotError(
            f"{urdf}: joint {name!r} follows {master!r}, which is no moving joint; "
            f"{options(master, joints)}"
        )
    try:
        times, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
    except ValueError:
        times = float("nan")
    if not np.isfinite([times, offset]).all():
        raise RobotError(
            f"{urdf}: joint {name!r}: its <mimic> has no finite multiplier and offset; mend it"
        )
    return _Follows(master, times, offset)
