"""The calibration finds what was drawn, knows how well, and says what it does not know."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.calibration.estimate import Estimate, estimate_mounts
from app.calibration.page import page
from app.calibration.planes import planes_of
from app.calibration.recording import load_motion, save_recording
from app.calibration.words import report_of
from app.errors import ConfigError, SensorError
from app.robot.model import Robot, find_robot, load_robot
from app.robot.mounts import with_mounts
from app.robot.skin import Skin, zone_centres
from app.robot.skin_file import load_skin
from app.world.scene import find_scene, load_scene
from tests.calibrated_arm import Gathered, gathered, renamed, reordered, some_of

NAMES = ("ring1-03", "ring2-09", "ring3-04")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(find_robot("ur10e"))


@pytest.fixture(scope="module")
def skin(robot: Robot) -> Skin:
    return some_of(load_skin(robot.layout, robot), robot, NAMES)


@pytest.fixture(scope="module")
def seen(robot: Robot, skin: Skin) -> Gathered:
    return gathered(robot, skin, "honest,late_ms=40")


@pytest.fixture(scope="module")
def found(seen: Gathered) -> Estimate:
    return estimate_mounts(seen.robot, seen.skin, seen.planes, seen.recording)


def off_by(found: Estimate, seen: Gathered) -> tuple[np.ndarray, np.ndarray]:
    """Distances [mm] and angles [deg] to the truth, by nothing that the calibration uses."""
    mm, deg = [], []
    for a, b in zip(
        with_mounts(seen.skin, found.mounts, seen.robot).sensors, seen.truth.skin.sensors,
        strict=True,
    ):  # fmt: skip
        mm.append(1e3 * np.linalg.norm(a.T_link_sensor[:3, 3] - b.T_link_sensor[:3, 3]))
        cosine = (np.trace(a.T_link_sensor[:3, :3].T @ b.T_link_sensor[:3, :3]) - 1) / 2
        deg.append(np.degrees(np.arccos(min(cosine, 1.0))))
    return np.array(mm), np.array(deg)


def test_sensors_glued_on_by_hand_are_found(found: Estimate, seen: Gathered) -> None:
    mm, deg = off_by(found, seen)
    laid_out = np.linalg.norm(seen.skin.origin - seen.truth.skin.origin, axis=1)
    assert np.median(laid_out) > 2e-3
    sure = np.array([not m.unsure for m in found.mounts.sensor])
    assert sure.sum() == 2
    assert mm[sure].max() < 2.0
    assert deg[sure].max() < 0.25


def test_a_dirty_window_is_named(found: Estimate) -> None:
    """That of the second sensor is dirty in this seed, whose frames are drawn with it."""
    assert found.after.dirty.tolist() == [False, True, False]
    assert "wipe it" in found.mounts.sensor[1].unsure


def test_how_late_the_stamps_are_is_found(found: Estimate) -> None:
    assert found.mounts.late_ms == pytest.approx(40.0, abs=3.0)
    assert found.mounts.late_sigma_ms < 2.0


def test_what_is_left_is_smaller_than_what_was(found: Estimate, seen: Gathered) -> None:
    rows = report_of(found, 0).rows
    assert rows[0]["residual_after_mm"] < 0.5 * rows[0]["residual_before_mm"]
    assert [r["name"] for r in rows[1:]] == list(NAMES)


def test_the_page_needs_nothing_but_itself(found: Estimate) -> None:
    text = page(found, "Mounts <of> a skin")
    assert "Mounts &lt;of&gt; a skin" in text
    assert text.count("<svg") == len(NAMES)
    assert "://" not in text and "src=" not in text
    assert all(name in text for name in NAMES)


def test_swapped_sensors_are_found(seen: Gathered) -> None:
    swapped = renamed(seen.recording, np.array([1, 0, 2]))
    mounts = estimate_mounts(seen.robot, seen.skin, seen.planes, swapped).mounts
    assert [m.place for m in mounts.sensor] == [NAMES[1], NAMES[0], ""]
    assert not any(m.rotation_deg for m in mounts.sensor)


@pytest.mark.parametrize(("rotation", "mirrored"), [(90, False), (180, False), (0, True)])
def test_a_turned_or_mirrored_sensor_is_found(
    seen: Gathered, rotation: int, mirrored: bool
) -> None:
    k = 1
    mounted = replace(seen.skin.sensors[k], rotation_deg=rotation, mirrored=mirrored)
    straight = zone_centres(seen.skin.sensors[k])
    order = [int(np.linalg.norm(straight - u, axis=1).argmin()) for u in zone_centres(mounted)]
    turned = reordered(seen.recording, k, np.array(order))
    one = estimate_mounts(seen.robot, seen.skin, seen.planes, turned).mounts.sensor
    assert (one[k].rotation_deg, one[k].mirrored) == (rotation, mirrored)
    assert one[0].rotation_deg is None and one[2].mirrored is None


def test_a_sensor_that_saw_too_little_is_named_unsure(seen: Gathered) -> None:
    r = seen.recording
    early = (r.sensor == 2) & (r.stamp > r.stamp.min() + 5.0)
    little = replace(r, **{n: getattr(r, n)[~early] for n in
                           ("sensor", "stamp", "distance", "status", "targets")})  # fmt: skip
    mounts = estimate_mounts(seen.robot, seen.skin, seen.planes, little).mounts
    assert not mounts.sensor[0].unsure
    assert "a wall" in mounts.sensor[2].unsure
    assert mounts.sensor[2].sigma_mm > 1.0


def test_a_motion_is_read_as_it_was_saved(seen: Gathered, tmp_path: Path) -> None:
    save_recording(tmp_path / "m.npz", seen.recording)
    again = load_motion(tmp_path / "m.npz", seen.robot, seen.skin)
    np.testing.assert_array_equal(again.distance, seen.recording.distance)
    assert again.layout == seen.skin.title


def test_a_file_that_is_no_motion_is_refused(
    robot: Robot, skin: Skin, seen: Gathered, tmp_path: Path
) -> None:
    (tmp_path / "text.npz").write_text("nothing")
    with pytest.raises(SensorError, match="is no recorded motion"):
        load_motion(tmp_path / "text.npz", robot, skin)
    save_recording(tmp_path / "other.npz", replace(seen.recording, robot="swan7"))
    with pytest.raises(SensorError, match="is of swan7"):
        load_motion(tmp_path / "other.npz", robot, skin)


def test_a_scene_without_anything_flat_is_refused() -> None:
    scene = load_scene(find_scene("empty"))
    with pytest.raises(ConfigError, match="add the table, a wall or a board"):
        planes_of(replace(scene, bodies=()))
