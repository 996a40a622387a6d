"""The virtual controller without a network: registers in, motion out."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import ConfigError
from app.robot.ur.wire import Kind, Packet, WireError, pack
from app.virtual.ur.controller import HALT, REDUCED_SPEED, UrController
from app.virtual.ur.dashboard import answer
from app.virtual.ur.faults import Fault, parse_fault
from app.virtual.ur.rtde import RtdeClient
from tests.virtual_ur import HOME, standing_after

SCRIPT = "def rtde_control():\nend\n"


def run(controller, seconds):
    for _ in range(round(seconds / 0.002)):
        controller.step()


def ask(controller, command, *numbers):
    controller.write(
        {f"input_double_register_{i}": float(x) for i, x in enumerate(numbers)}
        | {"input_int_register_0": command}
    )


def speed(controller, v, acceleration=4.0):
    ask(controller, 9, 0, 0, 0, v, 0, 0, acceleration, 0.002)


@pytest.fixture
def controller():
    c = UrController(HOME)
    c.upload(SCRIPT)
    run(c, 0.2)
    return c


def test_a_program_says_that_it_is_ready_once_it_runs():
    c = UrController(HOME)
    c.upload(SCRIPT)
    c.step()
    assert not c.playing and c.read("output_int_register_0") == 0
    run(c, 0.2)
    assert c.playing and c.read("output_int_register_0") == 1
    assert c.read("robot_status_bits") == 3 and c.read("runtime_state") == 2


def test_a_velocity_is_reached_with_the_acceleration_that_was_asked_for(controller):
    speed(controller, 0.4, acceleration=2.0)
    run(controller, 0.1)
    assert controller.read("actual_qd")[3] == pytest.approx(0.2, abs=0.01)
    run(controller, 0.3)
    assert controller.read("actual_qd") == pytest.approx((0, 0, 0, 0.4, 0, 0))


def test_the_time_of_a_velocity_is_no_watchdog(controller):
    speed(controller, 0.4)
    run(controller, 2.0)
    assert controller.read("actual_qd")[3] == pytest.approx(0.4)
    assert controller.playing


def test_the_watchdog_ends_the_program_and_the_arm_brakes_when_commands_cease(controller):
    ask(controller, 35, 20.0)
    run(controller, 0.01)
    assert controller.read("output_int_register_0") == 2
    for _ in range(50):
        speed(controller, 0.4)
        run(controller, 0.004)
    assert controller.playing
    ceased = controller.now
    run(controller, 0.3)
    assert not controller.playing and "watchdog" in controller.log[-1]
    assert standing_after(controller.trace, ceased) == pytest.approx(0.05 + 0.4 / HALT, abs=0.008)


def test_an_empty_command_feeds_the_watchdog(controller):
    ask(controller, 35, 20.0)
    for _ in range(50):
        run(controller, 0.02)
        ask(controller, 0)
    assert controller.playing


def test_a_stop_answers_when_the_arm_stands(controller):
    speed(controller, 0.4)
    run(controller, 0.5)
    ask(controller, 15, 4.0)
    run(controller, 0.05)
    assert controller.read("output_int_register_0") == 1 and not controller.joints.still
    run(controller, 0.1)
    assert controller.read("output_int_register_0") == 2 and controller.joints.still


def test_the_script_is_stopped_by_its_command_and_by_the_dashboard(controller):
    ask(controller, 255)
    run(controller, 0.01)
    assert not controller.playing
    controller.upload(SCRIPT)
    run(controller, 0.2)
    assert answer(controller, "stop") == "Stopped" and not controller.playing


def test_a_command_that_is_not_emulated_ends_the_program_with_its_number(controller):
    ask(controller, 1)
    run(controller, 0.01)
    assert not controller.playing and "command 1 is not emulated" in controller.log[-1]


def test_a_protective_stop_ends_the_program_and_must_be_unlocked(controller):
    speed(controller, 0.4)
    run(controller, 0.5)
    controller.stop(3)
    run(controller, 0.2)
    assert controller.joints.still and controller.read("safety_mode") == 3
    controller.upload(SCRIPT)
    run(controller, 0.2)
    assert not controller.playing
    assert "releasing" in answer(controller, "unlock protective stop")
    ask(controller, 0)  # as the client does: a command left in its register would be obeyed
    controller.upload(SCRIPT)
    run(controller, 0.2)
    assert controller.playing and controller.joints.still


def test_a_fault_begins_after_the_first_motion():
    c = UrController(HOME, [Fault("protective", 0.1), Fault("drop", 0.2, 0.3)])
    c.upload(SCRIPT)
    run(c, 1.0)
    assert c.safety_mode == 1
    speed(c, 0.2)
    run(c, 0.15)
    assert c.safety_mode == 3 and c.cut == ""
    run(c, 0.1)
    assert c.cut == "drop"
    run(c, 0.3)
    assert c.cut == ""


def test_the_speed_slider_scales_a_velocity_and_is_told(controller):
    controller.set_slider(0.25)
    speed(controller, 0.4)
    run(controller, 0.5)
    assert controller.read("actual_qd")[3] == pytest.approx(0.1)
    assert controller.read("target_speed_fraction") == 0.25
    assert controller.read("speed_scaling") == 1.0


def test_a_client_moves_the_slider_when_its_mask_says_so():
    c = UrController(HOME)
    c.write({"speed_slider_mask": 0, "speed_slider_fraction": 0.3})
    assert c.read("target_speed_fraction") == 1.0
    c.write({"speed_slider_mask": 1, "speed_slider_fraction": 0.3})
    assert c.read("target_speed_fraction") == 0.3


def test_reduced_mode_slows_the_arm_to_its_limit_and_tells_by_how_much(controller):
    speed(controller, 0.8)
    run(controller, 0.5)
    controller.reduce()
    run(controller, 0.5)
    assert controller.read("actual_qd")[3] == pytest.approx(REDUCED_SPEED)
    assert controller.read("speed_scaling") == pytest.approx(REDUCED_SPEED / 0.8)
    assert controller.playing and controller.read("safety_status_bits") == 2
    assert answer(controller, "safetymode") == "Safetymode: REDUCED"
    speed(controller, 0.1)
    run(controller, 0.5)
    assert controller.read("actual_qd")[3] == pytest.approx(0.1)
    assert controller.read("speed_scaling") == 1.0


def test_a_slider_and_reduced_mode_are_faults_with_a_time():
    c = UrController(HOME, [parse_fault("slider@0.1:0.5"), parse_fault("reduced@0.2")])
    c.upload(SCRIPT)
    run(c, 0.2)
    speed(c, 0.2)
    run(c, 0.15)
    assert (c.slider, c.safety_mode) == (0.5, 1)
    run(c, 0.1)
    assert c.safety_mode == 2


def test_faults_are_written_in_words_and_wrong_ones_are_named():
    assert parse_fault("drop@5:2") == Fault("drop", 5.0, 2.0)
    assert parse_fault("local") == Fault("local")
    assert parse_fault("slider@5:0.3") == Fault("slider", 5.0, 0.3)
    assert parse_fault("silent") == Fault("silent") and parse_fault("silent@1").at == 1.0
    wrongs = ("drip@5", "drop", "drop@", "drop@x", "drop@-1", "drop@1:0", "local@3", "slider@1:2")
    for wrong in wrongs:
        with pytest.raises(ConfigError, match=r"drop"):
            parse_fault(wrong)


def setup(client, *recipe):
    return client.take(Packet(Kind.INPUTS, ",".join(recipe).encode()))[3:]


def test_an_input_belongs_to_one_client_until_it_leaves():
    controller, owners = UrController(HOME), {}
    first, second = RtdeClient(controller, owners), RtdeClient(controller, owners)
    assert setup(first, "input_int_register_0") == b"\x01INT32"
    assert setup(first, "input_int_register_0", "input_double_register_1") == b"\x02INT32,DOUBLE"
    assert setup(second, "input_int_register_0") == b"\x00IN_USE"
    first.leave()
    assert setup(second, "input_int_register_0") == b"\x01INT32"


def test_an_unknown_output_is_named_and_nothing_is_started():
    client = RtdeClient(UrController(HOME), {})
    reply = client.take(Packet(Kind.OUTPUTS, struct.pack(">d", 500.0) + b"actual_q,mood,"))
    assert reply[3:] == b"\x01VECTOR6D,NOT_FOUND"
    assert client.take(Packet(Kind.START, b"")) == pack(Kind.START, b"\x00")
    assert client.data() == b""


def test_a_slow_client_is_sent_every_fourth_state():
    client = RtdeClient(UrController(HOME), {})
    client.take(Packet(Kind.OUTPUTS, struct.pack(">d", 125.0) + b"timestamp"))
    client.take(Packet(Kind.START, b""))
    assert sum(bool(client.data()) for _ in range(40)) == 10


def test_data_without_its_recipe_is_refused():
    client = RtdeClient(UrController(HOME), {})
    with pytest.raises(WireError, match="recipe 1"):
        client.take(Packet(Kind.DATA, b"\x01\x00\x00\x00\x09"))
    with pytest.raises(WireError, match="kind 0"):
        client.take(Packet(0, b""))


@given(st.lists(st.tuples(st.sampled_from([*b"VvMUOISP", 0, 255]), st.binary(max_size=60))))
def test_a_client_that_talks_garbage_is_answered_or_refused_in_words(packets):
    client = RtdeClient(UrController(HOME), {})
    for packet in packets:
        try:
            client.take(Packet(*packet))
        except WireError as refused:
            assert "\n" not in str(refused)
    client.data()


def test_the_dashboard_tells_the_state_and_what_it_does_not_understand():
    c = UrController(HOME, [Fault("local")])
    assert answer(c, "is in remote control") == "false"
    assert answer(c, "robotmode") == "Robotmode: RUNNING"
    assert "could not understand" in answer(c, "make coffee")
    c.stop(7)
    assert answer(c, "safetystatus") == "Safetystatus: ROBOT_EMERGENCY_STOP"


def test_joints_stop_at_their_ends(controller):
    speed(controller, 2.0, acceleration=40.0)
    run(controller, 8.0)
    assert controller.read("actual_q")[3] == pytest.approx(np.radians(360.0))
    assert controller.joints.still
