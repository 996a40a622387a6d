"""The overlay on a layout: what is written is read, what it says is where the sensors sit."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from app.errors import RobotError
from app.messages import JointState, SensorFrame
from app.robot.model import Robot, find_robot, load_robot
from app.robot.mounts import MountsTable, MountTable, load_mounts, save_mounts, with_mounts
from app.robot.ranges import RangeTable
from app.robot.skin import Skin
from app.robot.skin_file import load_skin


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(find_robot("ur10e"))


@pytest.fixture(scope="module")
def skin(robot: Robot) -> Skin:
    return load_skin(robot.layout, robot)


def mounts_of(skin: Skin, *sensors: MountTable, **facts: float) -> MountsTable:
    facts = {"late_sigma_ms": 1.0} | facts
    return MountsTable(robot="ur10e", layout=skin.title, sensor=sensors, **facts)


def test_what_is_saved_is_read(tmp_path: Path, skin: Skin) -> None:
    zones = tuple(np.linspace(-2, 2, 64).round(3).tolist())
    told = mounts_of(
        skin,
        MountTable(name="ring1-01", shift_mm=(1.0, -2.0, 0.5), turn_deg=(0.1, 0.0, -0.4),
                   sigma_mm=0.3, sigma_deg=0.04, zone_percent=zones, zone_sigma_percent=0.2),
        MountTable(name="ring1-02", place="ring1-03", rotation_deg=90, mirrored=True,
                   sigma_mm=2.0, sigma_deg=0.5, unsure="saw 3 returns"),
        late_ms=40.0,
    )  # fmt: skip
    save_mounts(tmp_path / "mounts.toml", told)
    assert load_mounts(tmp_path / "mounts.toml") == told


def test_a_shift_is_in_the_sensors_own_frame(robot: Robot, skin: Skin) -> None:
    one = MountTable(name="ring1-01", shift_mm=(0, 0, 5), sigma_mm=1, sigma_deg=0.1)
    new, k = with_mounts(skin, mounts_of(skin, one), robot), skin.index("ring1-01")
    np.testing.assert_allclose(new.origin[k], skin.origin[k] + 0.005 * skin.axis[k])
    np.testing.assert_allclose(np.delete(new.origin, k, 0), np.delete(skin.origin, k, 0))


def test_a_turn_is_a_rotation_vector_in_degrees(robot: Robot, skin: Skin) -> None:
    one = MountTable(name="ring1-01", turn_deg=(0, 10, 0), sigma_mm=1, sigma_deg=0.1)
    new, k = with_mounts(skin, mounts_of(skin, one), robot), skin.index("ring1-01")
    R, a = skin.sensors[k].T_link_sensor[:3, :3], np.radians(10)
    np.testing.assert_allclose(new.axis[k], R @ [np.sin(a), 0, np.cos(a)], atol=1e-12)


def test_swapped_sensors_sit_in_each_others_places(robot: Robot, skin: Skin) -> None:
    swap = [MountTable(name=a, place=b, sigma_mm=1, sigma_deg=0.1)
            for a, b in (("ring1-01", "ring3-05"), ("ring3-05", "ring1-01"))]  # fmt: skip
    new = with_mounts(skin, mounts_of(skin, *swap), robot)
    assert [s.name for s in new.sensors] == [s.name for s in skin.sensors]
    a, b = skin.index("ring1-01"), skin.index("ring3-05")
    np.testing.assert_array_equal(new.origin[[a, b]], skin.origin[[b, a]])


def test_a_range_is_corrected_by_the_table_and_then_by_the_overlay(
    robot: Robot, skin: Skin
) -> None:
    table = RangeTable(np.array([0.2, 1.0]), np.tile([0.004, -0.01], (skin.slots, 1)))
    one = MountTable(name="ring1-01", zone_percent=(1.0,) * 64, sigma_mm=1, sigma_deg=0.1)
    new = with_mounts(replace(skin, ranges=table), mounts_of(skin, one), robot)
    slots = skin.zones(skin.index("ring1-01"))
    for depth in (0.2, 1.0):
        mine = np.full(64, depth)
        all_slots = np.arange(skin.slots)[slots]
        before = table.corrected(all_slots, mine)
        np.testing.assert_allclose(new.ranges.corrected(all_slots, mine), 1.01 * before)


def test_a_frame_with_a_late_stamp_is_placed_where_the_arm_was(robot: Robot, skin: Skin) -> None:
    from app.cell.parts import Cell
    from app.perception.perception import Perception
    from app.perception.rules import Rules

    late = with_mounts(skin, mounts_of(skin, late_ms=40.0), robot)
    assert late.late == pytest.approx(0.04)
    places = []
    for who, stamp in ((skin, 0.06), (late, 0.10)):
        perception = Perception(robot, who, Cell())
        for t in np.arange(0.0, 0.21, 0.01):
            perception._history.append(JointState(t, robot.home + t, np.ones(robot.n)))
        ones = np.ones(64, dtype=np.uint8)
        frame = SensorFrame(0, stamp, 1, np.full(64, 0.7), 5 * ones, ones)
        perception._take([frame], Rules())
        places.append(perception._cloud.newest().points[skin.zones(0)].copy())
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)


def test_what_was_measured_is_in_less_doubt(robot: Robot, skin: Skin) -> None:
    one = MountTable(
        name="ring1-01", sigma_mm=0.4, sigma_deg=0.1, zone_percent=(0.0,) * 64,
        zone_sigma_percent=0.3,
    )  # fmt: skip
    doubt = with_mounts(skin, mounts_of(skin, one), robot).doubt
    assert doubt.position[0] == pytest.approx(0.4e-3)
    assert doubt.angle[0] == pytest.approx(np.radians(0.1))
    assert doubt.share[0] == pytest.approx(0.003)
    assert doubt.time[0] == pytest.approx(0.001)
    np.testing.assert_array_equal(doubt.position[1:], skin.doubt.position[1:])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"robot": "swan7"}, "are of swan7"),
        ({"layout": "another"}, "'another'"),
        ({"sensor": (MountTable(name="ring9-01", sigma_mm=1, sigma_deg=1),)}, "no sensor"),
        (
            {"sensor": (MountTable(name="ring1-01", place="ring1-02", sigma_mm=1, sigma_deg=1),)},
            "both sit in the place of ring1-02",
        ),
        (
            {"sensor": (MountTable(
                name="ring1-01", zone_percent=(1.0,), sigma_mm=1, sigma_deg=1),)},
            "zone_percent has 1 values",
        ),
    ],
)  # fmt: skip
def test_an_overlay_of_another_skin_is_refused(
    robot: Robot, skin: Skin, change: dict, words: str
) -> None:
    with pytest.raises(RobotError, match=words) as error:
        with_mounts(skin, msgspec.structs.replace(mounts_of(skin), **change), robot)
    assert "flinch calibrate mounts" in str(error.value)


def test_a_file_of_a_later_version_says_so(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('version = 9\nrobot = "a"\nnew_words = 1\n')
    with pytest.raises(RobotError, match="version = 9, this Flinch reads 1; update it"):
        load_mounts(tmp_path / "m.toml")
