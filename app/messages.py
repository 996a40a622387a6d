"""The vocabulary: the values that travel between rooms. `app.actions` is the way back in.

All are frozen, and their arrays are read-only once they leave the room that made them
(`freeze`). Lengths are metres, angles radians, times seconds on the runtime's clock, poses
4x4 matrices `T_a_b` (b expressed in a). `base` is the robot's base frame.

Slots: the zones of all sensors stand one after the other in every array of a `Cloud`, from the
frame to the page; zone j of sensor k is row `Skin.first[k] + j`.
"""

from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.config import Params
from app.near import NOTHING_NEAR, Nearness

Array = NDArray[np.float64]


def freeze(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, from now on read-only."""
    array.flags.writeable = False
    return array


# --- from the sensors ---------------------------------------------------------------------


@dataclass(frozen=True, eq=False, slots=True)
class SensorFrame:
    """One measurement of one time-of-flight sensor, as many values as its type has zones.

    distance: (n,) [m] as the sensor reports it: depth along the optical axis or length of the
              zone's ray (see `app.robot.skin`); junk where `targets` is 0.
    status:   (n,) uint8, the maker's target status; its type says what it is worth.
    targets:  (n,) uint8, number of targets seen in the zone.
    stamp:    when it was measured [s]; it arrives later.
    """

    sensor: int
    stamp: float
    sequence: int
    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


class SensorHealth(IntEnum):
    """What is known of one sensor; the page colours by it."""

    ABSENT = 0  # no source is connected to it
    WAITING = 1  # connected, has not spoken yet
    GOOD = 2  # speaks, and most zones are usable or honestly empty
    POOR = 3  # speaks, but more than half of its zones have a bad status
    STALE = 4  # has spoken, but not within the allowed age
    FROZEN = 5  # speaks, but repeats the same values over and over
    SATURATED = 6  # most of its zones see something right at the lens: covered or dirty
    SLOW = 7  # speaks at less than half of the rate that its type has


@dataclass(frozen=True, eq=False, slots=True)
class JointState:
    """Joint positions q (n,) [rad or m] and velocities qd (n,) at `stamp` [s]."""

    stamp: float
    q: Array
    qd: Array


# --- perception ---------------------------------------------------------------------------


class Verdict(IntEnum):
    """Why a zone's point is, or is not, believed to be something in the world."""

    KEPT = 0  # a point of the world
    SELF = 1  # the robot's own body, within the threshold of the hit
    BEHIND = 2  # farther than the body that stands in the ray's way: impossible
    STATIC = 3  # inside the known, static cell
    BAD_STATUS = 4  # the sensor itself does not trust it
    NO_TARGET = 5  # the sensor saw nothing; its distance is junk
    OUT_OF_RANGE = 6  # nearer or farther than the accepted range
    STALE = 7  # the frame is older than the allowed age
    EMPTY = 8  # no frame has come yet
    GHOST = 9  # nearer than what was seen before, by one zone in one frame only: not yet believed
    CONTACT = 10  # at the lens, nearer than can be measured; held until it is seen to leave


@dataclass(frozen=True, eq=False, slots=True)
class Cloud:
    """Every zone of the skin with its verdict (S zones, K sensors).

    points:  (S, 3) [m] base frame; NaN where the zone has no distance.
    verdict: (S,) uint8 of `Verdict`.
    link:    (S,) int16, body link in the ray's way, -1 if none.
    gap:     (S,) [m] what the body would have returned less what was measured, as the sensor
             reports it; positive = the point lies before the body, +inf if none is in the way.
    eps:     (S,) [m] threshold that `gap` was compared with; NaN where it was not.
    stamp:   (K,) [s] time of each sensor's newest frame, -inf before the first.
    """

    points: Array
    verdict: NDArray[np.uint8]
    link: NDArray[np.int16]
    gap: Array
    eps: Array
    stamp: Array

    def kept(self) -> Array:
        """Points of the world, (m, 3) [m], base frame."""
        kept: Array = self.points[self.verdict == Verdict.KEPT]
        return kept


@dataclass(frozen=True, eq=False, slots=True)
class Pairs:
    """Closest pair between the world and each control body (B rows).

    For whole-body control a row is a body link; for mounting-point control a row is a
    sensor. Rows without a world point have distance +inf and NaN points.

    link:     (B,) int, link that moves the robot's point.
    distance: (B,) [m] signed, positive outside the body.
    on_robot: (B, 3) [m] base frame.   on_world: (B, 3) [m] base frame.
    normal:   (B, 3) unit vector from the world to the robot: the direction of retreat.
    slot:     (B,) int, row of the cloud that the world's point came from, -1 if none; rows
              beyond the cloud are the memory's.
    closest:  row of the smallest distance of what can move, -1 if the cloud is empty.
    approach: (B,) [m/s] speed of the world's point along the normal, positive = it comes
              nearer; zero when unsure. None: not estimated.
    approach_sigma: (B,) [m/s] 1 sigma of it. None: not estimated.
    sigma:    (B,) [m] 1 sigma of the distance as measured, +inf without a point. None: not
              estimated.
    age:      (B,) [s] since the world's point was measured, +inf without a point. None: not
              asked for.
    source:   (B,) int, which measured pair each one follows, -1 of one that is out of sight for
              the moment. None: these are the measured ones.
    """

    link: NDArray[np.intp]
    distance: Array
    on_robot: Array
    on_world: Array
    normal: Array
    slot: NDArray[np.intp]
    closest: int
    approach: Array | None = None
    approach_sigma: Array | None = None
    sigma: Array | None = None
    age: Array | None = None
    source: NDArray[np.intp] | None = None

    @property
    def minimum(self) -> float:
        """Smallest distance [m], +inf when there is no point."""
        return float(self.distance[self.closest]) if self.closest >= 0 else np.inf

    def measured(self, row: int) -> int:
        """The measured pair that a row follows; -1 of none, and of row -1."""
        return row if self.source is None or row < 0 else int(self.source[row])


# --- control ------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, slots=True)
class Goal:
    """Where the tool frame should be: T_base_tool (4, 4)."""

    T_base_tool: Array


@dataclass(frozen=True, eq=False, slots=True)
class Wish:
    """A velocity that is asked for instead of a goal; one of the two is given.

    twist: (6,) [m/s, rad/s] of the tool, axes of the base.   qd: (n,) [rad/s] of the joints.
    """

    twist: Array | None = None
    qd: Array | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Granted:
    """What became of a wish in one tick.

    share: of what was asked for that the command does, along it; below 0 it goes the other way.
    by:    what holds the rest back, in words; empty while nothing does.
    """

    wish: Wish
    share: float
    by: str


@dataclass(frozen=True, eq=False, slots=True)
class Command:
    """Joint velocities qd (n,) [rad/s] that keep every limit, and how they came about.

    activation: 0..1, how far the avoidance acts; where it is made of bounds, 1 if one holds.
    reference:  retreat speed asked for along the normal [m/s].
    progress:   0..1 of what was asked for that limits and bounds leave.
    control_row: row of the pairs that the controller was told of, which it acted on, -1 if none.
    slack:       largest amount by which a bound had to give way [m/s].
    protective:  speed and separation: distance [m] that the nearest pair needs, 0 if not in use.
    reason:      why the arm brakes or waits though it may move; empty otherwise.
    unseen:      0..1 of what was asked for that lets the body stop before unseen space.
    unseen_of:   the sensor whose space that is, -1 where nothing is held back.
    """

    qd: Array
    activation: float = 0.0
    reference: float = 0.0
    progress: float = 1.0
    control_row: int = -1
    slack: float = 0.0
    protective: float = 0.0
    reason: str = ""
    unseen: float = 1.0
    unseen_of: int = -1


class Mode(StrEnum):
    """What the arm is allowed to do; a person's choice or a stop's."""

    IDLE = "idle"  # stands still until the sensors have spoken
    RUNNING = "running"  # goes to the goal and gives way
    HOLDING = "holding"  # stays where it is and gives way
    STOPPED = "stopped"  # brakes and stands still


@dataclass(frozen=True, slots=True)
class Status:
    """The supervisor's mode, why, and since when [s]."""

    mode: Mode
    reason: str
    since: float


@dataclass(frozen=True, slots=True)
class Notice:
    """What became of a person's last action; `refused` says that it was not done."""

    words: str = ""
    refused: bool = False


NO_NOTICE = Notice()


@dataclass(frozen=True, eq=False, slots=True)
class BackgroundView:
    """The learned background, (n, 3) [m] centres of its cells, base frame; the same objects as
    long as nothing changes.

    known:   what counts as static and bounds the motion.
    preview: what has just been learned and waits for a person to keep it or to discard it.
    left:    [s] until the learning that runs ends; 0 when none runs.
    """

    known: Array
    preview: Array
    left: float = 0.0


# --- what leaves a tick -------------------------------------------------------------------


@dataclass(frozen=True, eq=False, slots=True)
class BodyView:
    """How a body of the simulated world looks; the same object as long as it looks the same.

    vertices: (V, 3) [m] body frame.   faces: (F, 3) int.   colour: RGB, 0..255.
    movable:  a person may drag it; the parts of a walking person are not.
    """

    name: str
    vertices: Array
    faces: NDArray[np.int64]
    colour: tuple[int, int, int]
    movable: bool


@dataclass(frozen=True, eq=False, slots=True)
class BodyPose:
    """Where a body of the simulated world is now: for drawing and for judging only."""

    view: BodyView
    T_base_body: Array


@dataclass(frozen=True, eq=False, slots=True)
class Timing:
    """Where the milliseconds of one tick went [s], by room, and how late it began.

    preferred: does the system run the control thread before all ordinary ones?
    rate:      [Hz] ticks that are asked for, 0 of a recording.
    """

    rooms: dict[str, float]
    lateness: float
    preferred: bool = False
    rate: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class GhostState:
    """A second controller's arm: links (L, 4, 4), smallest perceived distance [m], command."""

    mode: str
    T_base_link: Array
    distance: float
    command: Command


@dataclass(frozen=True, eq=False, slots=True)
class Snapshot:
    """All that an onlooker may know of one tick.

    T_base_link: (L, 4, 4) poses of the body links at `joints.q`.
    pairs, body: the pairs that the controller used; and those of the whole body, always.
    health:      (K,) uint8 of `SensorHealth`.   rate: (K,) frames a second.
    delay:       (K,) [s] from a frame's measurement to the tick that used it, mean; NaN = none.
    inputs:      names of what the frames come from and how each is, in words.
    real:        (K,) bool of a mixed skin, sensors that are not simulated; None of another.
    world:       poses of the simulated bodies, to draw them; empty with real sensors.
    notice:      what became of the last action of a person, in words.
    jump:        [m] how far the acted-on control point moved since the last tick.
    ghost:       a second controller's arm; None without one.
    program:     the waypoint program that runs and how far it is, in words; empty if none.
    advice:      what holds the arm back though it may move, in words; empty if nothing does.
    memory:      (n, 3) [m] remembered points near the arm, base frame.
    reached:     waypoints that the program has reached.
    blind:       0..1 share of what the skin should see that it cannot tell of.
    unable:      (K,) uint8 of `app.perception.unable.Unable`; the same array while nothing changes.
    background:  the learned background and what is being learned.
    nearness:    what can give way, what cannot, and what holds the arm.
    spoiled:     sensors by index to which a person has done something, and what.
    granted:     what became of a jog, of the way home or of a program's wish; None without one.
    """

    tick: int
    stamp: float
    joints: JointState
    T_base_link: Array
    T_base_tool: Array
    goal: Goal
    cloud: Cloud
    pairs: Pairs
    body: Pairs
    command: Command
    status: Status
    params: Params
    health: NDArray[np.uint8]
    rate: Array
    world: tuple[BodyPose, ...]
    timing: Timing
    notice: Notice = NO_NOTICE
    jump: float = 0.0
    advice: str = ""
    program: str = ""
    memory: Array = field(default_factory=lambda: np.empty((0, 3)))
    ghost: GhostState | None = None
    delay: Array = field(default_factory=lambda: np.empty(0))
    inputs: tuple[tuple[str, str], ...] = ()
    real: NDArray[np.bool_] | None = None
    reached: int = 0
    blind: float = 0.0
    unable: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, dtype=np.uint8))
    background: BackgroundView = field(
        default_factory=lambda: BackgroundView(np.empty((0, 3)), np.empty((0, 3)))
    )
    nearness: Nearness = NOTHING_NEAR
    spoiled: tuple[tuple[int, str], ...] = ()
    granted: Granted | None = None
