"""The virtual controller without its sockets: modes, registers, the program and the arm.

Everything happens in `step`, 500 times a second; the sockets only write input registers, hand
over a program, ask the dashboard and read outputs.
"""

from collections import deque
from collections.abc import Callable, Iterable

import numpy as np

from app.messages import Array
from app.robot.ur.wire import Value
from app.virtual.ur.faults import Fault
from app.virtual.ur.joints import Joints
from app.virtual.ur.program import UploadedProgram
from app.virtual.ur.variables import OUTPUTS

PERIOD = 0.002  # [s] of the e-Series' control loop
VERSION = (5, 15, 0, 126)
VERSIONS = {"cb3": (3, 15, 8, 106339), "polyscopex": (10, 7, 0, 0)}
MODEL = "UR10"  # what a UR10e's dashboard says, too
HALT = 10.0  # [rad/s^2] assumed for a program that ends in motion; the maker gives no figure
REDUCED_SPEED = 0.4  # [rad/s] assumed of the fastest joint in reduced mode; it is configured
STOP = 15.0  # [rad/s^2] assumed for a protective or an emergency stop
CONTROL = "def rtde_control():"  # the only program that is understood
TRACE = 5000  # cycles of the arm's motion that are kept

_POWERED, _PLAYING = 1, 2
_NORMAL, _REDUCED = 1, 2  # safety modes in which the arm moves
_BITS = {1: 1 << 0, 2: 1 << 1, 3: 1 << 2 | 1 << 10, 7: 1 << 6 | 1 << 7 | 1 << 10}


class UrController:
    """One robot: `q` (6,) [rad] is its posture at the start; `say` hears what happens to it."""

    def __init__(
        self, q: Array, faults: Iterable[Fault] = (), say: Callable[[str], None] | None = None
    ) -> None:
        self.joints = Joints(q)
        self.now = 0.0  # [s] the controller's own clock
        self.robot_mode, self.safety_mode, self.remote = 7, _NORMAL, True
        self.version = VERSION
        self.slider = 1.0  # 0..1, on the pendant
        self.scaling = 1.0  # 0..1, how far a motion is slowed to keep to a safety limit
        self.program: UploadedProgram | None = None
        self.log: deque[str] = deque(maxlen=200)  # what has happened, in words
        self._say = say
        self.trace: deque[tuple[float, float]] = deque(maxlen=TRACE)  # time, fastest joint
        self.moved_at: float | None = None  # when a joint moved for the first time
        self.uploads = 0
        self.commands = 0  # writes to the command register with a command in it
        self._faults = [f for f in faults if f.at is not None]
        self._cut: tuple[str, float] = ("", 0.0)
        self._ints_in, self._ints_out = [0] * 48, [0] * 48
        self._doubles_in = [0.0] * 48
        self._written = 0.0
        self._patience = 0.0
        for fault in faults:
            if fault.at is None:
                self._begin_with(fault.kind)

    @property
    def joints_still(self) -> bool:
        """Does no joint move?"""
        return self.joints.still

    @property
    def fastest(self) -> float:
        """Speed of the fastest joint [rad/s]."""
        return float(np.abs(self.joints.qd).max())

    # --- the link -------------------------------------------------------------------------

    @property
    def cut(self) -> str:
        """What is done to the link now, a name of `faults.LINKS`; empty while it is well."""
        kind, until = self._cut
        return kind if self.now < until else ""

    def break_link(self, kind: str, length: float) -> float:
        """Break the link for `length` [s] as `kind` says, of `faults.LINKS`; when it was."""
        self._cut = (kind, self.now + length)
        self._log(f"{kind} for {length:g} s")
        return self.now

    def write(self, values: dict[str, Value]) -> None:
        """Take input variables from a client."""
        for name, value in values.items():
            kind, _, index = name.rpartition("_register_")
            if kind == "input_int" and isinstance(value, int):
                self._ints_in[int(index)] = value
            elif kind == "input_double" and isinstance(value, float):
                self._doubles_in[int(index)] = value
        slider = values.get("speed_slider_fraction")
        if values.get("speed_slider_mask") and isinstance(slider, float):
            self.set_slider(slider)
        if "input_int_register_0" in values:
            self._written = self.now
            self.commands += self._ints_in[0] != 0

    def read(self, name: str) -> Value:
        """The value of an output variable; zero for what is not modelled."""
        kind, _, index = name.rpartition("_register_")
        if kind == "output_int":
            return self._ints_out[int(index)]
        match name:
            case "timestamp":
                return self.now
            case "actual_q" | "target_q":
                return tuple(self.joints.q)
            case "actual_qd":
                return tuple(self.joints.qd)
            case "target_qd":
                return tuple(self.joints.target)
            case "robot_mode":
                return self.robot_mode
            case "safety_mode" | "safety_status":
                return self.safety_mode
            case "safety_status_bits":
                return _BITS[self.safety_mode]
            case "robot_status_bits":
                powered = _POWERED if self.robot_mode >= 4 else 0
                return powered | (_PLAYING if self.playing else 0)
            case "runtime_state":
                return 2 if self.playing else 1
            case "target_speed_fraction":
                return self.slider
            case "speed_scaling":
                return self.scaling
        return _ZERO[OUTPUTS[name]]

    # --- the program ----------------------------------------------------------------------

    @property
    def playing(self) -> bool:
        """Does a program run?"""
        return self.program is not None and self.program.running

    def upload(self, text: str) -> None:
        """Run a program that came in on 30003, in place of the one that runs."""
        if CONTROL not in text:
            self._log("a program that the virtual controller does not know: not run")
            return
        if not self._ready or not self.remote:
            self._log("a program was refused: the robot is not ready for it")
            return
        self._ints_out[0] = 0
        self.program = UploadedProgram(self)
        self.uploads += 1
        self._log("a control program came in")

    def end_program(self, reason: str) -> None:
        """Stop the program that runs, if any; the arm brakes."""
        if self.program is not None:
            self._log(f"the program has ended: {reason}")
        self.program = None

    def int_in(self, index: int) -> int:
        return self._ints_in[index]

    def double_in(self, index: int) -> float:
        return self._doubles_in[index]

    def int_out(self, index: int, value: int) -> None:
        self._ints_out[index] = value

    def be_patient(self, seconds: float) -> None:
        """Give every watchdog so much more time, where the machine is too busy for it."""
        self._patience = seconds

    def since_write(self) -> float:
        """Seconds since a client has written the command register."""
        return self.now - self._written - self._patience

    # --- time -----------------------------------------------------------------------------

    def step(self, dt: float = PERIOD) -> None:
        """One cycle."""
        self.now += dt
        self._inject()
        program = self.program
        if program is not None:
            program.step(self.joints.still, dt)
            if program.ended:
                self.end_program(program.ended)
        if not self._ready:
            self.joints.step(np.zeros(6), STOP, dt)
        elif self.program is None:
            self.joints.step(np.zeros(6), HALT, dt)
        else:
            drive = self.program.drive
            self.joints.step(self._slowed(drive.target), drive.acceleration, dt)
        if self.fastest > 0.0 and self.moved_at is None:
            self.moved_at = self.now
            self._log("the arm moves for the first time")
        self.trace.append((self.now, self.fastest))

    @property
    def _ready(self) -> bool:
        """May the arm move?"""
        return self.safety_mode in (_NORMAL, _REDUCED) and self.robot_mode == 7

    def _slowed(self, target: Array) -> Array:
        """The velocity that is really driven: the slider's share of what was asked for, and in
        reduced mode no more than is allowed there (assumed to hold for `speedj`, too)."""
        asked = self.slider * target
        fastest = np.abs(asked).max()
        limited = self.safety_mode == _REDUCED and fastest > REDUCED_SPEED
        self.scaling = float(REDUCED_SPEED / fastest) if limited else 1.0
        return asked * self.scaling

    def set_slider(self, share: float) -> None:
        """Move the speed slider to `share`, 0..1."""
        self.slider = min(max(share, 0.0), 1.0)
        self._log(f"the speed slider is at {100.0 * self.slider:.0f} %")

    def reduce(self) -> None:
        """Change to the reduced mode of the safety system."""
        self.safety_mode = _REDUCED
        self._log("reduced mode")

    def stop(self, safety_mode: int) -> None:
        """A protective (3) or an emergency stop (7)."""
        self.safety_mode = safety_mode
        self._log("protective stop" if safety_mode == 3 else "emergency stop")
        if safety_mode == 7:
            self.robot_mode = 3
        self.end_program("safety stop")

    def unlock(self) -> None:
        """What a person does at the pendant: the arm is ready again, no program runs."""
        self.safety_mode, self.robot_mode = _NORMAL, 7
        self._log("unlocked")

    def _log(self, line: str) -> None:
        line = f"{self.now:9.3f} s  {line}"
        self.log.append(line)
        if self._say is not None:
            self._say(line)

    def _begin_with(self, kind: str) -> None:
        if kind == "local":
            self.remote = False
        elif kind == "off":
            self.robot_mode = 3
        elif kind in VERSIONS:
            self.version = VERSIONS[kind]
        else:
            self._cut = (kind, np.inf)

    def _inject(self) -> None:
        if self.moved_at is None:
            return
        since = self.now - self.moved_at
        for fault in [f for f in self._faults if f.at is not None and since >= f.at]:
            self._faults.remove(fault)
            match fault.kind:
                case "protective":
                    self.stop(3)
                case "emergency":
                    self.stop(7)
                case "slider":
                    self.set_slider(fault.value)
                case "reduced":
                    self.reduce()
                case kind:
                    self.break_link(kind, fault.value)


_ZERO: dict[str, Value] = {
    "INT32": 0, "UINT32": 0, "UINT64": 0, "DOUBLE": 0.0, "VECTOR3D": (0.0,) * 3,
    "VECTOR6D": (0.0,) * 6, "VECTOR6INT32": (0,) * 6,
}  # fmt: skip
