"""What a UR says of itself in words, its clock on ours, and the question at the console."""

import io

import numpy as np
import pytest

from app.cli import main
from app.cli.confirm import confirm
from app.errors import ConfigError
from app.robot.ur.clock import ControllerClock
from app.robot.ur.safety import Report, trouble
from app.setup import Setup, driver_host


def report(robot=7, safety=1, bits=3):
    return Report(robot, safety, bits, 2)


@pytest.mark.parametrize("host", ["[::1]", "::1", "[fe80::1%eth0]", "192.0.2.7", "robot.local"])
def test_a_host_may_be_a_name_or_an_address_of_either_kind(host):
    driver = f"ur:{host}"
    assert Setup(driver=driver).driver == driver
    assert driver_host(driver) == host.strip("[]")


@pytest.mark.parametrize("host", ["", "192.0.2.7:30004", "[::1]:30004", "a:b"])
def test_a_host_with_a_port_is_refused(host):
    with pytest.raises(ConfigError, match="ports are fixed"):
        Setup(driver=f"ur:{host}")


def test_an_arm_that_can_move_is_in_no_trouble():
    assert trouble(report()) == "" and trouble(report(safety=2)) == ""


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (report(safety=3), "protective stop"),
        (report(safety=5), "safeguard stop"),
        (report(safety=6), "emergency stop of the cell"),
        (report(safety=7, robot=3), "emergency stop of the robot"),
        (report(safety=8), "violation"),
        (report(safety=9), "fault"),
        (report(safety=99), "safety mode 99"),
        (report(robot=3), "switched off"),
        (report(robot=5), "brakes"),
        (report(robot=6), "freedrive"),
        (report(robot=42), "robot mode 42"),
        (report(bits=7), "freedrive"),
    ],
)
def test_every_other_state_is_named_with_its_remedy(said, words):
    text = trouble(said)
    assert words in text and ":" in text and "\n" not in text


def test_states_are_stamped_when_they_were_taken_though_they_come_late():
    rng, clock = np.random.default_rng(4), ControllerClock()
    late = []
    for k in range(2000):
        theirs = 0.002 * k
        stamp = clock.stamp(theirs, 100.0 + theirs * (1 + 50e-6) + 0.001 + rng.exponential(0.003))
        late.append(stamp - (100.0 + theirs * (1 + 50e-6)))
    assert min(late[500:]) > 0.0009 and max(late[500:]) < 0.002


def test_stamps_never_go_back_nor_ahead_of_now():
    clock = ControllerClock()
    stamps = [clock.stamp(t, now) for t, now in [(5, 10.0), (5.002, 10.001), (5.004, 10.2)]]
    assert stamps == sorted(stamps) and stamps[-1] <= 10.2


def test_clocks_that_stand_otherwise_to_each_other_are_believed_within_two_seconds():
    clock = ControllerClock()
    for k in range(500):
        clock.stamp(0.01 * k, 0.01 * k + 0.002)
    for k in range(500, 720):
        stamp = clock.stamp(0.01 * k, 0.01 * k + 0.4)
    assert stamp == pytest.approx(0.01 * 719 + 0.4)


def test_a_controller_that_was_started_anew_is_stamped_anew():
    clock = ControllerClock()
    clock.stamp(5000.0, 100.0)
    assert clock.stamp(0.5, 160.0) == pytest.approx(160.0)


def test_the_typed_address_lets_the_arm_move(capsys):
    confirm("ur:192.0.2.7", "serial:/dev/ttyACM0", lambda question: " 192.0.2.7 ")
    shown = capsys.readouterr().out
    assert "no safety function" in shown and "NOT ON THE ARM" not in shown


@pytest.mark.parametrize("sensors", ["simulated", "serial:/dev/ttyACM0=ring1+simulated"])
def test_sensors_that_are_not_on_the_arm_are_called_so(sensors, capsys):
    confirm("ur:192.0.2.7", sensors, lambda question: "192.0.2.7")
    assert "NOT ON THE ARM" in capsys.readouterr().out


@pytest.mark.parametrize("typed", ["", "yes", "192.0.2.8"])
def test_anything_else_that_is_typed_refuses(typed):
    with pytest.raises(ConfigError, match="nothing was sent"):
        confirm("ur:192.0.2.7", "simulated", lambda question: typed)


def test_an_end_of_input_refuses(capsys):
    def ended(question):
        raise EOFError

    with pytest.raises(ConfigError, match="nothing was sent"):
        confirm("ur:192.0.2.7", "simulated", ended)
    assert "NOT ON THE ARM" in capsys.readouterr().out


def refused(capsys, *args):
    assert main(args) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("flinch: ") and err.count("\n") == 1
    return err


def test_a_pipe_cannot_say_yes(capsys, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("192.0.2.7\n"))
    assert "terminal" in refused(
        capsys, "run", "--driver", "ur:192.0.2.7", "--arm", "--cell", "table"
    )


def test_a_real_arm_refuses_to_be_run_faster_than_time(capsys):
    assert "faster than real time" in refused(
        capsys, "run", "--headless", "--driver", "ur:192.0.2.7"
    )


def test_a_real_arm_is_given_no_posture_to_begin_in(capsys):
    home = ("--home-deg", "0", "-90", "90", "0", "0", "0", "--no-open", "--port", "0")
    assert "where it stands" in refused(capsys, "run", "--driver", "ur:192.0.2.7", *home)


def test_an_unknown_driver_is_one_line(capsys):
    for wrong in ("kuka:1", "ur", "ur:", "ur:host:30004", "simulated:3"):
        assert "'ur:HOST'" in refused(capsys, "run", "--no-open", "--port", "0", "--driver", wrong)
    assert "--driver" in refused(capsys, "run", "--headless", "--arm", "--cell", "table")
