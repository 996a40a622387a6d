"""Real sensors on ports, on a manual clock: who is who, what stops the arm, and in what words."""

import numpy as np
import pytest

from app.actions import SetGoal, SetMode, UseSensor
from app.errors import SensorError
from app.messages import JointState, Mode, SensorHealth
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.mixed import MixedSkin
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.sensing.simulated import SimulatedSkin
from app.sensing.wire import lines
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World
from tests.ports import Board, HandPort, raw

RINGS = [range(0, 10), range(10, 20), range(20, 30)]


class Cell:
    """An engine whose skin hangs on three ports, a board of ten sensors on each."""

    def __init__(self, robot, skin, claims=((), (), ()), mixed=False, params=None):
        self.robot, self.clock = robot, ManualClock()
        self.ports = [HandPort(f"/dev/ring{i + 1}") for i in range(3)]
        self.boards = [Board(p, ring) for p, ring in zip(self.ports, RINGS, strict=True)]
        specs = [
            PortSpec(p.name, sensors=tuple(c)) for p, c in zip(self.ports, claims, strict=True)
        ]
        self.source = SerialSkin(skin, self.ports, specs)
        self.world, self.arm = World(()), SimulatedArm(robot)
        source = self.source
        if mixed:
            eye = SimulatedSkin(robot, skin, self.world, 0, ErrorModel(ideal=True))
            source = MixedSkin(self.source, eye)
        self.engine = assemble(robot, skin, self.arm, source, self.world, self.clock,
            Start(params=params),
        )  # fmt: skip

    def run(self, seconds, *actions):
        for a in actions:
            self.engine.post(a)
        for _ in range(round(seconds * 250)):
            for board in self.boards:
                board.run(self.clock.now())
            snapshot = self.engine.step()
        return snapshot

    def away(self, snapshot):
        """A goal that takes seconds to reach."""
        T = np.array(snapshot.T_base_tool)
        T[1, 3] -= 0.5
        return SetGoal(T)

    def running(self):
        """Frames come and the arm moves."""
        s = self.run(0.3)
        s = self.run(0.5, self.away(s))
        assert s.status.mode is Mode.RUNNING and np.abs(s.joints.qd).max() > 0.05
        return s


@pytest.fixture
def cell(robot, skin):
    return Cell(robot, skin)


def test_every_frame_finds_its_sensor_and_its_zones(cell, skin):
    k = 17
    rising = np.arange(64) * 10 + 300
    cell.boards[1].frame = lambda s, n, t: raw(s, n, t, rising if s == k else 1000)
    s = cell.run(0.3)
    assert (s.health == SensorHealth.GOOD).all()
    points = s.cloud.points[k * 64 : k * 64 + 64]
    T = s.T_base_link[skin.link[k]]
    local = (points - T[:3, 3]) @ T[:3, :3]
    depth = (local - skin.origin[k]) @ skin.axis[k]
    assert np.allclose(depth, rising * 1e-3, atol=4e-3)  # the arm gives way a little


def test_unplugging_stops_the_arm_at_once_and_says_which_port(cell):
    cell.running()
    cell.ports[1].unplug()
    s = cell.run(0.008)
    assert s.status.mode is Mode.STOPPED
    assert s.status.reason == "port /dev/ring2 is lost (unplugged or switched off)"
    assert np.abs(cell.run(0.5).joints.qd).max() < 1e-6


def test_after_replugging_the_stream_resumes_and_the_arm_waits_for_a_person(cell):
    cell.running()
    cell.ports[1].unplug()
    s = cell.run(1.0)
    assert (s.health[10:20] == SensorHealth.STALE).all()
    s = cell.run(0.1, SetMode(Mode.RUNNING))
    assert s.status.mode is Mode.STOPPED and "is lost" in s.status.reason
    cell.ports[1].plug()
    s = cell.run(1.0)
    assert (s.health[10:20] == SensorHealth.GOOD).all()
    assert s.status.mode is Mode.STOPPED and np.abs(s.joints.qd).max() < 1e-6
    s = cell.run(1.0, SetMode(Mode.RUNNING))
    assert s.status.mode is Mode.RUNNING and np.abs(s.joints.qd).max() > 0.05


@pytest.mark.parametrize("quiet", [(0, 1, 2), (1,)], ids=["whole skin", "one port of three"])
def test_a_silent_port_stops_the_arm_half_a_second_after_its_last_frame(cell, quiet):
    cell.running()
    for i in quiet:
        cell.boards[i].quiet = True
    assert cell.run(0.4).status.mode is Mode.RUNNING
    s = cell.run(0.112)
    assert s.status.mode is Mode.STOPPED and "silent" in s.status.reason
    if len(quiet) == 3:  # it has slowed down all the while
        assert np.abs(s.joints.qd).max() < 0.02
    else:
        assert s.status.reason.startswith("port /dev/ring2 is silent for 0.5 s")
    assert np.abs(cell.run(0.3).joints.qd).max() < 1e-3


def test_bytes_without_a_whole_frame_stop_the_arm_as_garbled(cell):
    cell.running()
    cell.boards[2].garble = lambda packet: packet[:50] + b"?" + packet[51:]
    s = cell.run(0.6)
    assert s.status.mode is Mode.STOPPED
    assert s.status.reason.startswith("port /dev/ring3 is garbled: no whole frame for 0.5 s")


def test_bit_errors_of_1e_4_cost_frames_but_no_wrong_one_gets_through(cell):
    from app.virtual.skin.faults import Faults, FaultyWire

    cable = FaultyWire(Faults(bits=1e-4), 0.0, seed=4)
    cell.boards[0].garble = lambda packet: cable.wire(packet, 0.0)
    s = cell.run(2.5)
    assert s.status.mode is Mode.RUNNING
    words = dict(s.inputs)["/dev/ring1"]
    assert words.startswith("noisy · binary · 10 sensors · ") and "damaged" in words
    facts = cell.ports[0].facts()
    assert facts.damaged > 30 and facts.lost > 30
    points = s.cloud.points[:640]
    depth = np.linalg.norm(points - np.roll(points, 64, axis=0), axis=1)
    assert np.isfinite(depth).any()
    kept = cell.engine.brain._guard.health._figures.distance[:10]
    assert np.isin(np.round(kept, 6), [1.0, 1.001]).all()


def test_a_clock_that_drifts_by_100_ppm_and_wraps_keeps_its_stamps(cell):
    for board in cell.boards:
        board.boot_us, board.ppm = (1 << 32) - 3_000_000, 100.0
    s = cell.run(9.0)
    assert s.status.mode is Mode.RUNNING
    # frames are said when they are measured, so what is left is the tick that said them
    assert s.delay.max() < 0.01 and s.delay.min() >= 0.0
    assert cell.ports[0].facts().drift == pytest.approx(-100e-6, abs=20e-6)
    assert "clock -" in dict(s.inputs)["/dev/ring1"]


def test_a_board_that_was_reset_goes_on_and_is_told_of(cell):
    cell.boards[0].boot_us = 900_000_000
    cell.run(0.5)
    cell.boards[0].boot_us = 0
    s = cell.run(0.5)
    assert s.status.mode is Mode.RUNNING and (s.health == SensorHealth.GOOD).all()
    assert "clock began anew 1 times" in dict(s.inputs)["/dev/ring1"]
    assert cell.ports[0].facts().lost == 0


@pytest.mark.parametrize(
    ("ppm", "says"), [(-1e6, "its clock stands still"), (-2e6, "its clock runs backwards")]
)
def test_a_board_whose_clock_is_none_stops_the_arm_by_its_own_name(cell, ppm, says):
    cell.running()
    cell.boards[1].boot_us = 1_000_000_000
    cell.boards[1].ppm = ppm
    s = cell.run(0.8)
    assert s.status.mode is Mode.STOPPED
    assert s.status.reason == f"port /dev/ring2 has a bad clock: {says}"
    assert dict(s.inputs)["/dev/ring2"].startswith("bad clock")


def test_a_late_frame_is_placed_with_the_joints_of_its_own_time(robot, skin):
    """The arm turns; a frame that comes 80 ms late is a point of where the arm was."""
    from app.brain import Brain
    from app.plant.plant import listen
    from app.tick import ArmReport, Inputs

    port = HandPort(format_name="binary")
    source = SerialSkin(skin, [port], [PortSpec(port.name)])
    brain = Brain(robot, skin)
    qd = np.array([0.5, 0, 0, 0, 0, 0])
    late, still = 0.08, np.zeros(6)
    for i in range(500):
        now = i * 0.004
        joints = JointState(now, robot.home + qd * now, qd)
        if i % 20 == 0:  # early ones show the shortest way, then one is late
            t = now if i < 400 else now - late
            mm = 600 + i // 20 % 2  # what repeats itself while it is moved is frozen
            port.say(raw(15, i // 20, round(t * 1e6), mm), now)
        frames, said = listen(source, now, robot.posture(joints.q), 0.5)
        x = Inputs(i, now, 0.004, 0.0, joints, still, ArmReport(), frames, said)
        cloud = brain.tick(x).cloud
        if i == 440:
            break
    then = robot.posture(robot.home + qd * (now - late)).T_base_link[skin.link[15]]
    where = skin.origin[15] + 0.6 * skin.reach[15 * 64 : 16 * 64]
    assert np.allclose(
        cloud.points[15 * 64 : 16 * 64], where @ then[:3, :3].T + then[:3, 3], atol=1e-4
    )
    there = robot.posture(joints.q).T_base_link[skin.link[15]]
    assert np.abs(where @ there[:3, :3].T + there[:3, 3] - cloud.points[960:1024]).max() > 0.02


# --- who is who ---------------------------------------------------------------------------


def test_two_ports_that_are_swapped_stop_the_arm_and_say_so(robot, skin):
    cell = Cell(robot, skin, claims=RINGS)
    cell.running()
    a, b = cell.boards[0], cell.boards[1]
    a.port, b.port = b.port, a.port
    s = cell.run(0.1)
    assert s.status.mode is Mode.STOPPED
    assert s.status.reason.startswith("port /dev/ring1: it speaks for ring2-")
    assert s.status.reason.endswith("which /dev/ring2 should; cables or ids are swapped")
    words = dict(s.inputs)
    assert words["/dev/ring1"].startswith("swapped") and words["/dev/ring2"].startswith("swapped")
    again = cell.run(1.0, SetMode(Mode.RUNNING))
    assert again.status.mode is Mode.STOPPED


def test_ports_without_a_claim_may_change_places_since_frames_know_their_sensor(cell):
    cell.running()
    a, b = cell.boards[0], cell.boards[1]
    a.port, b.port = b.port, a.port
    s = cell.run(0.2)
    assert s.status.mode is Mode.STOPPED and "and so does /dev/ring" in s.status.reason
    s = cell.run(2.0)
    s = cell.run(0.5, SetMode(Mode.RUNNING))
    assert s.status.mode is Mode.RUNNING and (s.health == SensorHealth.GOOD).all()


def test_two_ports_that_speak_for_one_sensor_are_a_conflict(cell):
    cell.boards[2].sensors = [5, *range(21, 30)]
    s = cell.run(0.5)
    assert s.status.mode is Mode.STOPPED
    assert "it speaks for ring1-06, and so does /dev/ring" in s.status.reason
    assert "conflict" in " ".join(words for _, words in s.inputs)
    assert s.health[20] == SensorHealth.ABSENT and s.health[5] == SensorHealth.GOOD


@pytest.mark.parametrize(
    ("frame", "says"),
    [
        (lambda s, n, t: raw(s + 200, n, t), "it sends sensor id 210, the layout has 30 sensors"),
        (lambda s, n, t: raw(s, n, t, grid=(4, 4)), "reports 4x4 zones, the layout has 8x8"),
    ],
)
def test_a_board_that_does_not_fit_the_layout_is_a_misfit(cell, frame, says):
    cell.boards[1].frame = frame
    s = cell.run(0.5)
    assert s.status.mode is Mode.STOPPED and says in s.status.reason
    assert dict(s.inputs)["/dev/ring2"].startswith("misfit")


def test_a_format_that_names_no_sensor_needs_one(skin, robot):
    posture, sent = robot.posture(robot.home), b"\n" + lines.encode(raw(distance=700))
    port = HandPort(format_name="lines")
    anonymous = SerialSkin(skin, [port], [PortSpec(port.name)])
    port.hear(sent, 0.0)
    assert anonymous.poll(0.0, posture) == []
    says = "port /dev/hand: its format names no sensor; give one as PORT=SENSOR"
    assert anonymous.fault(0.1, 0.5, anonymous.connected) == says
    named = SerialSkin(skin, [port], [PortSpec(port.name, sensors=(4,))])
    port.hear(sent, 0.2)
    (frame,) = named.poll(0.2, posture)
    assert (
        frame.sensor == 4
        and frame.stamp == pytest.approx(0.19)
        and frame.distance == pytest.approx(0.7)
    )
    assert named.fault(0.2, 0.5, named.connected) == ""
    assert (
        "no status: what is within the sensor's range counts as valid"
        in dict(named.inputs(0.2))["/dev/hand"]
    )


@pytest.mark.parametrize("claims", [RINGS, ((), (), ())], ids=["claimed", "unclaimed"])
def test_while_a_port_is_still_booting_the_arm_waits(robot, skin, claims):
    cell = Cell(robot, skin, claims)
    for board in cell.boards:
        board.quiet = True
    s = cell.run(0.4)
    assert s.status.mode is Mode.IDLE and dict(s.inputs)["/dev/ring1"] == "waiting"
    s = cell.run(3.0)
    assert s.status.mode is Mode.STOPPED
    assert s.status.reason == "port /dev/ring1 has not said anything yet"
    cell.boards[0].quiet = cell.boards[1].quiet = False
    s = cell.run(1.0, SetMode(Mode.RUNNING))
    assert s.status.reason == "port /dev/ring3 has not said anything yet"
    cell.boards[2].quiet = False
    assert cell.run(0.2).status.mode is Mode.STOPPED
    assert cell.run(0.2, SetMode(Mode.RUNNING)).status.mode is Mode.RUNNING


def test_what_has_piled_up_in_a_port_before_the_arm_started_is_not_taken(skin, robot):
    port = HandPort(format_name="binary")
    source = SerialSkin(skin, [port], [PortSpec(port.name)])
    for i in range(150):
        port.say(raw(0, i, round(i / 15 * 1e6)), i / 15)
    frames = source.poll(10.0, robot.posture(robot.home))
    assert [f.sequence for f in frames] == [147, 148, 149]


def test_a_stall_of_this_machine_is_not_taken_for_a_silence_of_the_ports(cell):
    cell.running()
    cell.clock.t += 1.0
    for board in cell.boards:
        board.count = round(cell.clock.t * 150.0)  # what came meanwhile is gone
    assert cell.run(0.3).status.mode is Mode.RUNNING


def test_closing_the_engine_gives_the_ports_back(cell):
    cell.run(0.1)
    cell.engine.close()
    assert all(p.closed for p in cell.ports)


# --- mixed skins --------------------------------------------------------------------------


def test_a_mixed_skin_simulates_what_no_port_speaks_for(robot, skin):
    cell = Cell(robot, skin, mixed=True)
    cell.boards[1].quiet = cell.boards[2].quiet = True
    s = cell.run(0.5)
    assert s.real.tolist() == [k < 10 for k in range(30)]
    assert (s.health[:10] == SensorHealth.GOOD).all()
    speaking = np.isin(s.health, [SensorHealth.GOOD, SensorHealth.FROZEN])
    assert speaking.all()
    # the real ones report 1 m; before the simulated ones there is nothing
    seen = s.cloud.verdict.reshape(30, 64) == 0
    assert seen[:10].any(axis=1).all() and not seen[10:].any()


def test_sensors_of_a_mixed_skin_are_switched_one_by_one(robot, skin):
    cell = Cell(robot, skin, mixed=True)
    cell.boards[1].quiet = cell.boards[2].quiet = True
    cell.run(0.5)
    s = cell.run(0.5, UseSensor("ring1-03", False))
    assert s.real.tolist() == [k < 10 and k != 2 for k in range(30)]
    seen = s.cloud.verdict.reshape(30, 64) == 0
    assert not seen[2].any() and seen[3].any()
    s = cell.run(0.5, UseSensor("ring1-03", True))
    assert s.real[2] and (s.cloud.verdict.reshape(30, 64) == 0)[2].any()
    assert "ring9" in cell.run(0.02, UseSensor("ring9", True)).notice.words


def test_a_lost_port_is_no_fault_once_all_of_its_sensors_are_simulated(robot, skin):
    cell = Cell(robot, skin, mixed=True)
    cell.run(0.5)
    cell.ports[0].unplug()
    assert cell.run(0.1).status.mode is Mode.STOPPED
    for k in range(10):
        cell.engine.post(UseSensor(skin.sensors[k].name, False))
    s = cell.run(0.5, SetMode(Mode.RUNNING))
    assert s.status.mode is Mode.RUNNING


def test_a_skin_that_is_not_mixed_refuses_the_switch(cell):
    assert "sensors cannot be switched" in cell.run(0.02, UseSensor("ring1-01", True)).notice.words


# --- the words after serial: --------------------------------------------------------------


def test_ports_are_parsed_with_speed_format_and_sensors(skin):
    one, two, three = parse_ports("/dev/a@115200#lines=ring2-03, /dev/b=ring1,/dev/c@9600", skin)
    assert one == PortSpec("/dev/a", 115200, "lines", (12,))
    assert two == PortSpec("/dev/b", 0, "", tuple(range(10)))
    assert three == PortSpec("/dev/c", 9600)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("/dev/a@1", "1 baud; give 9600 to 12000000"),
        ("/dev/a#lined", "did you mean 'lines'"),
        ("/dev/a=ring7", "no sensor or ring 'ring7'; did you mean 'ring"),
        ("/dev/a,/dev/a", "/dev/a is given twice"),
        ("/dev/a=ring1,/dev/b=ring1-02", "both claim ring1-02"),
        ("/dev/a:latency_ms=soon", "latency_ms = soon; give 0 to 150 ms"),
        ("/dev/a=ring1:latency_ms=-1", "latency_ms = -1; give 0 to 150 ms"),
        ("/dev/a,", "is not understood; give PORT"),
    ],
)
def test_ports_that_make_no_sense_are_refused_in_one_line(skin, text, says):
    with pytest.raises(SensorError) as error:
        parse_ports(text, skin)
    assert says in str(error.value) and "\n" not in str(error.value)
