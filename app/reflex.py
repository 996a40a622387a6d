"""A reflex for others: between whoever moves an arm and the arm, the least change that keeps clear.

    guard = flinch.Guard.of("ur10e")
    command = guard.step(frames, joints, flinch.Twist(twist))       # once a tick
    arm.send(command.qd)

It is Flinch's own brain, with perception, bounds and stops, without engine, plant and page. What
is wanted takes the place of a person's jog: with nothing near it passes unchanged, as far as the
joints' speed and acceleration and the settings' `joint_speed` allow. What it cannot do: see what no
sensor looks at; make up for an arm that does not follow; stand in for an emergency stop.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.actions import Action, SetMode, Want
from app.brain import Brain
from app.cell.parts import Cell
from app.choices import build_robot_and_skin
from app.config import Params
from app.control.wish import DONE
from app.errors import ConfigError
from app.guard import STALL
from app.messages import Array, JointState, Mode, SensorFrame, freeze
from app.rehearsal import rehearse, silent
from app.robot.model import Robot
from app.robot.skin import Skin
from app.setup import Setup
from app.tick import ArmReport, Inputs, Outputs, SourceReport
from app.world.cells import find_cell, read_cell

FIRST = 0.004  # [s] that the first command is meant to hold
SHORTEST = 1e-4  # [s] between two steps
LIMITS = "the joints' own limits of speed, acceleration and range"
UNHURT = 1e-9  # [rad/s] within which a command is what was wanted


@dataclass(frozen=True, eq=False, slots=True)
class Pose:
    """The tool is wanted at T_base_tool (4, 4), at the speeds that the settings name."""

    T_base_tool: Array


@dataclass(frozen=True, eq=False, slots=True)
class Twist:
    """The tool is wanted to move so: (6,) [m/s, rad/s], linear first, axes of the base."""

    twist: Array


@dataclass(frozen=True, eq=False, slots=True)
class JointSpeeds:
    """The joints are wanted to move so: (n,) [rad/s]."""

    qd: Array


Wanted = Pose | Twist | JointSpeeds


@dataclass(frozen=True, eq=False, slots=True)
class Command:
    """What to do instead.

    qd:      (n,) [rad/s] to send, until the next step.
    reason:  why it is not what was wanted; empty where it is.
    share:   of what was wanted that is done, along it; below 0 the arm gives way.
    stopped: nothing moves until `Guard.resume`; the reason says why.
    """

    qd: Array
    reason: str
    share: float
    stopped: bool


class Guard:
    """One arm's. Call it from one thread, at 30 to 500 Hz, with every frame as it comes."""

    def __init__(
        self, robot: Robot, skin: Skin, cell: Cell | None = None, params: Params | None = None
    ) -> None:
        """cell: the known static place; None: nothing is known, and all that is seen is kept
        clear of."""
        self.robot, self.skin, self.cell = robot, skin, cell or Cell()
        self._brain = Brain(robot, skin, self.cell, params, begin=Mode.HOLDING)
        self._everybody: NDArray[np.bool_] = freeze(np.ones(skin.count, dtype=np.bool_))
        self._sequence = [0] * skin.count
        self._before: float | None = None  # [s] of the last step
        self._applied: Array = freeze(np.zeros(robot.n))
        self._tick, self._resumes = 0, False

    @classmethod
    def of(
        cls, robot: str = "ur10e", skin: str = "", cell: str = "", params: Params | None = None
    ) -> "Guard":
        """By names or paths as `flinch run` takes them; a FlinchError says what is not known."""
        made, worn = build_robot_and_skin(Setup(robot=robot, skin=skin))
        return cls(made, worn, read_cell(find_cell(cell)) if cell else None, params)

    def warm_up(self, progress: Callable[[int, int, str], None] = silent) -> None:
        """Compile what is not compiled yet; before the arm moves, or a first step takes seconds.

        progress: told of each kernel by its number, of how many, and its name.
        """
        rehearse(self.robot, self.skin, self.cell, self._brain.params, progress)

    def frame(
        self, sensor: str, stamp: float, distance: Array, status: NDArray[np.uint8] | None = None,
        targets: NDArray[np.uint8] | None = None,
    ) -> SensorFrame:  # fmt: skip
        """A measurement of the sensor called so in the layout, zones in the maker's order.

        distance: [m], NaN where nothing was seen.   status, targets: as the sensor reports them;
        left out: every distance is sound.   FlinchError for a name or a size that does not fit.
        """
        k = self.skin.index(sensor)
        kind, d = self.skin.sensors[k].type, np.array(distance, dtype=np.float64).reshape(-1)
        if len(d) != kind.zones:
            raise ConfigError(f"{sensor} has {kind.zones} zones, not {len(d)}; give one value each")
        seen = np.isfinite(d)
        sound = np.full(kind.zones, kind.status.valid, dtype=np.uint8)
        self._sequence[k] += 1
        return SensorFrame(
            k, float(stamp), self._sequence[k], freeze(np.where(seen, d, 0.0)),
            freeze(sound if status is None else np.array(status, dtype=np.uint8)),
            freeze(seen.astype(np.uint8) if targets is None else np.array(targets, np.uint8)),
        )  # fmt: skip

    def resume(self) -> None:
        """A person says that the arm may move again; in the next step it is tried."""
        self._resumes = True

    def step(
        self, frames: Sequence[SensorFrame], joints: JointState, wanted: Wanted | None,
        applied: Array | None = None,
    ) -> Command:  # fmt: skip
        """What to do at `joints.stamp` [s], a clock that only goes on, that of the frames as well.

        frames:  those that have come since the last step, each once.
        wanted:  None: stay where you are, and give way.
        applied: (n,) [rad/s] what the arm was really told, if not the last command.
        """
        x = self._inputs(frames, joints, wanted, applied)
        out = self._brain.tick(x)
        self._before, self._applied = x.now, out.command.qd
        self._tick, self._resumes = self._tick + 1, False
        return _answer(out, wanted)

    def _inputs(
        self, frames: Sequence[SensorFrame], joints: JointState, wanted: Wanted | None,
        applied: Array | None,
    ) -> Inputs:  # fmt: skip
        now = joints.stamp
        dt = FIRST if self._before is None else now - self._before
        if not dt >= SHORTEST:
            raise ConfigError(f"joints.stamp is {now} s, the last one {self._before}; give a later")
        actions: list[Action] = []
        if self._resumes:
            actions.append(SetMode(Mode.HOLDING, "resumed"))
        match wanted:
            case Pose(T_base_tool=T):
                actions.append(Want(T_base_tool=T))
            case Twist(twist=twist):
                actions.append(Want(twist=twist))
            case JointSpeeds(qd=qd):
                actions.append(Want(qd=qd))
        late = dt if dt > STALL else 0.0
        return Inputs(
            self._tick, now, min(dt, STALL), late, joints,
            self._applied if applied is None else applied, ArmReport(), tuple(frames),
            SourceReport(self._everybody), tuple(actions),
        )  # fmt: skip


def _answer(out: Outputs, wanted: Wanted | None) -> Command:
    stopped, granted = out.status.mode is Mode.STOPPED, out.granted
    if out.status.mode in (Mode.STOPPED, Mode.IDLE):
        return Command(out.command.qd, out.status.reason, 0.0, stopped)
    if out.notice.refused:
        return Command(out.command.qd, out.notice.words, 0.0, stopped)
    if wanted is None or granted is None:
        return Command(out.command.qd, out.advice, 1.0 if wanted is None else 0.0, stopped)
    passed = granted.share >= DONE
    if granted.wish.qd is not None:
        passed = bool(np.abs(out.command.qd - granted.wish.qd).max() <= UNHURT)
    reason = "" if passed else granted.by or out.advice or LIMITS
    return Command(out.command.qd, reason, granted.share, stopped)
