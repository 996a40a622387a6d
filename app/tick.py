"""What enters a tick and what leaves it: `Inputs` into the brain, `Outputs` out of it.

Whatever the brain knows of time, devices and people is in its `Inputs`; the same `Inputs` give
the same `Outputs` to the last bit. Both are frozen values: a recorder keeps them, a judge reads
them, another brain can be given them again.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.actions import Action
from app.config import Params
from app.messages import (
    NO_NOTICE,
    Array,
    BackgroundView,
    BodyPose,
    Cloud,
    Command,
    GhostState,
    Goal,
    Granted,
    JointState,
    Notice,
    Pairs,
    SensorFrame,
    Snapshot,
    Status,
    Timing,
)
from app.near import NOTHING_NEAR, Nearness


@dataclass(frozen=True, eq=False, slots=True)
class Limits:
    """What an arm allows of itself: joint velocities and accelerations, (n,) each."""

    qd_max: Array
    qdd_max: Array


@dataclass(frozen=True, slots=True)
class ArmReport:
    """What an arm says of itself, beside where it is.

    fault:  a reason to stop, with its remedy; empty when there is none.
    advice: what a person should know though it is no reason to stop.
    ready:  would it follow a command? While it would not, it is asked to stand.
    pace:   0..1 of its limits that it allows now: a speed slider, a reduced mode.
    """

    fault: str = ""
    advice: str = ""
    ready: bool = True
    pace: float = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class SourceReport:
    """What a source of frames says in one tick, beside its frames.

    connected: (K,) bool, sensors that it speaks for.
    fault:     why the arm must not move though frames may come again; empty if it may.
    ended:     why no frame will ever come again; empty while they may.
    inputs:    names of what it reads from, and how each is, in words.
    real:      (K,) bool of a mixed skin, sensors that are not simulated; None of another.
    trace:     of the exception behind the fault; empty if there was none.
    spoiled:   sensors by index to which a person has done something, and what; see `SpoilSensor`.
    """

    connected: NDArray[np.bool_]
    fault: str = ""
    ended: str = ""
    inputs: tuple[tuple[str, str], ...] = ()
    real: NDArray[np.bool_] | None = None
    trace: str = ""
    spoiled: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Inputs:
    """All that the brain learns of the world in one tick.

    tick:    counts from 0.   now: [s] on the runtime's clock.   dt: [s] since the last tick.
    late:    [s] how late the tick began.
    joints:  where the arm is.   applied: (n,) [rad/s] what it was really told in the last tick.
    actions: what people asked for since the last tick, in their order.
    refused: why the plant did not do the last of them; empty if it did, or had no part in it.
    fault:   what failed in the machine that runs us; empty while nothing has.
    """

    tick: int
    now: float
    dt: float
    late: float
    joints: JointState
    applied: Array
    arm: ArmReport
    frames: tuple[SensorFrame, ...]
    source: SourceReport
    actions: tuple[Action, ...] = ()
    refused: str = ""
    fault: str = ""


@dataclass(frozen=True, eq=False, slots=True)
class Outputs:
    """All that the brain decides in one tick, and what it believes.

    engage:      a person has asked for motion: a real arm may begin its control program.
    T_base_link: (L, 4, 4) poses of the body links at the joints of the tick's inputs.
    pairs, body: the pairs that the controller used; and those of the whole body, always.
    health:      (K,) uint8 of `SensorHealth`.   rate: (K,) frames a second.
    delay:       (K,) [s] from a frame's measurement to the tick that used it, mean; NaN = none.
    notice:      what became of the last action of a person, in words.
    advice:      what holds the arm back though it may move, in words; empty if nothing does.
    program:     the waypoint program that runs and how far it is, in words; empty if none.
    reached:     waypoints that it has reached.
    jump:        [m] how far the acted-on control point moved since the last tick.
    memory:      (n, 3) [m] remembered points near the arm, base frame.
    blind:       0..1 share of what the skin should see that it cannot tell of.
    unable:      (K,) uint8 of `app.perception.unable.Unable`; the same array while nothing changes.
    background:  the learned background and what is being learned.
    trace:       of the exception that ended this tick early; empty of any other.
    nearness:    what can give way, what cannot, and what holds the arm.
    granted:     what became of a jog, of the way home or of a program's wish; None without one.
    """

    command: Command
    engage: bool
    status: Status
    params: Params
    goal: Goal
    T_base_link: Array
    T_base_tool: Array
    cloud: Cloud
    pairs: Pairs
    body: Pairs
    health: NDArray[np.uint8]
    rate: Array
    delay: Array
    background: BackgroundView
    notice: Notice = NO_NOTICE
    advice: str = ""
    program: str = ""
    reached: int = 0
    jump: float = 0.0
    memory: Array = field(default_factory=lambda: np.empty((0, 3)))
    blind: float = 0.0
    unable: NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, dtype=np.uint8))
    trace: str = ""
    nearness: Nearness = NOTHING_NEAR
    granted: Granted | None = None


Tick = tuple[Inputs, Outputs]


class Follower(Protocol):
    """Who is handed every tick: a queue, or somebody who looks for one thing in it."""

    def put(self, value: Tick) -> None: ...
    def close(self) -> None: ...


def snapshot_of(
    x: Inputs,
    out: Outputs,
    timing: Timing,
    world: tuple[BodyPose, ...] = (),
    ghost: GhostState | None = None,
) -> Snapshot:
    """What an onlooker may know of a tick: what went in, what came out, and what was there."""
    return Snapshot(
        tick=x.tick, stamp=x.now, joints=x.joints, inputs=x.source.inputs, real=x.source.real,
        spoiled=x.source.spoiled,
        T_base_link=out.T_base_link, T_base_tool=out.T_base_tool, goal=out.goal,
        cloud=out.cloud, pairs=out.pairs, body=out.body, command=out.command,
        status=out.status, params=out.params, health=out.health, rate=out.rate, delay=out.delay,
        notice=out.notice, advice=out.advice, program=out.program, reached=out.reached,
        jump=out.jump, memory=out.memory, blind=out.blind, unable=out.unable,
        background=out.background, nearness=out.nearness, granted=out.granted,
        world=world, ghost=ghost, timing=timing,
    )  # fmt: skip
