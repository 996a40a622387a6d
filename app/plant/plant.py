"""What every plant can do: be read, be told a velocity, be asked by people, be closed."""

import traceback
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from app.actions import Action, SpoilSensor, UseSensor
from app.errors import FlinchError, WorldError
from app.messages import Array, BodyPose, JointState, SensorFrame
from app.robot.posture import Posture
from app.sensing.source import Source
from app.tick import ArmReport, Limits, SourceReport


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """What a plant says at one moment; `applied` (n,) [rad/s] is what the arm was really told."""

    joints: JointState
    applied: Array
    arm: ArmReport
    frames: tuple[SensorFrame, ...]
    source: SourceReport


class Arm(Protocol):
    """What a plant needs of an arm: a simulated one or a driver.

    limits: what it allows of itself, for the controller to plan with.
    """

    limits: Limits

    def state(self, now: float) -> JointState: ...
    def report(self, now: float) -> ArmReport: ...  # once a tick, before `send`
    def send(self, qd: Array, dt: float) -> Array: ...  # what is applied by then
    def applied(self, now: float) -> Array: ...  # what it was really told; after `report`
    def engage(self) -> None: ...  # a person asks for motion; returns at once
    def close(self) -> None: ...


class Plant(Protocol):
    """An arm and its skin, wherever they are. Nothing here waits for a device.

    name: where the frames come from, in words.   limits: the arm's own.
    editable: can people change the world that its sensors see?
    """

    name: str
    limits: Limits

    @property
    def editable(self) -> bool: ...

    def read(self, now: float, patience: float) -> Reading:
        """Where the arm is and what has arrived by `now` [s]; silence is borne for `patience`."""
        ...

    def send(self, qd: Array, dt: float) -> Array:
        """Tell the arm the joint velocities (n,) for `dt` [s]; returns what is applied by then,
        as far as that is known at once. The next reading knows better."""
        ...

    def engage(self) -> None:
        """A person asks for motion; returns at once."""
        ...

    def act(self, action: Action) -> None:
        """Do an action that is a plant's own; raises FlinchError when it cannot be done."""
        ...

    def bodies(self) -> tuple[BodyPose, ...]:
        """What is there to draw and to judge by; empty where nobody knows the truth."""
        ...

    def close(self) -> None:
        """Leave the arm at rest and give back what is held."""
        ...


def listen(
    source: Source, now: float, posture: Posture, patience: float
) -> tuple[tuple[SensorFrame, ...], SourceReport]:
    """Frames that have arrived, and what the source says of itself.

    A source that fails is a fault in its report: where the arm is must be known all the same.
    """
    connected = source.connected
    try:
        frames = tuple(source.poll(now, posture))
        connected = source.connected
        fault = source.fault(now, patience, connected)
        return frames, SourceReport(connected, fault, source.ended(), source.inputs(now))
    except Exception as error:
        known = isinstance(error, FlinchError)
        words = str(error) if known else f"the sensors cannot be read: {error!r}"
        return (), SourceReport(connected, fault=words, trace=traceback.format_exc())


def nothing_to_edit(action: Action) -> WorldError:
    """The refusal of a plant with no simulated world and no second skin."""
    sensors = isinstance(action, UseSensor | SpoilSensor)
    what = "sensors cannot be switched" if sensors else "no body can be put"
    return WorldError(f"{what} here; start with a simulated part, --sensors ...+simulated")


def refusal(plant: Plant, action: Action) -> str:
    """Have the plant do an action; why it did not, empty when it did.

    A browser may send anything: the arm goes on, the person is told.
    """
    try:
        plant.act(action)
    except Exception as error:
        known = isinstance(error, FlinchError | ValueError)
        return str(error) if known else f"{type(action).__name__} failed: {error!r}"
    return ""


def nothing_read(joints: int, sensors: int, now: float) -> Reading:
    """Of a plant that could not be read yet: nobody knows where the arm is."""
    nowhere = JointState(now, np.full(joints, np.nan), np.full(joints, np.nan))
    nobody = SourceReport(np.zeros(sensors, dtype=bool))
    return Reading(nowhere, np.zeros(joints), ArmReport(), (), nobody)
