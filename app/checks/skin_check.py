"""`flinch skin check`: does the sensor report what the layout believes it reports?

Two things to show it. A flat WALL, held anywhere: its points lie on a plane only if ranges are
read as what they are, depth along the axis or length of the ray. A moving HAND: first from
left to right, then from top to bottom, as seen from the sensor: the nearest zones must wander
the same way, else the order of the zones is mirrored or turned.
"""

import sys
from typing import Any

import numpy as np

from app.checks.skin_port import record_port
from app.choices import build_robot_and_skin
from app.errors import SensorError
from app.messages import Array
from app.paths import path_and_name
from app.report import Check, Report
from app.robot.sensor_type import PERPENDICULAR, RADIAL
from app.robot.skin import Sensor, Skin, zone_centres
from app.sensing.error_model import ErrorModel
from app.sensing.replays import recorded
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.timing import WallClock
from app.world.world import World

SURE = 1.15  # times the other reading's residual makes a convention certain
FEWEST = 20  # zones of a wall, or frames of a hand
LOOSE = 0.6  # share of the way that a hand's track must go along its axis


def skin_check(setup: Setup, what: str, recording: str = "simulated") -> Report:
    """`what`: 'wall' or 'hand'; recording: 'simulated', PATH[@SENSOR] or serial:PORT=SENSOR."""
    robot, skin = build_robot_and_skin(setup)
    port = recording.removeprefix("serial:")
    name = path_and_name(recording)[1] if port == recording else ""
    k = skin.index(name) if name else 15 % skin.count
    words = ""
    if port != recording:
        k, depth, words = record_port(port, robot, skin, what, WallClock(), _prompt)
    elif recording.startswith("simulated"):
        depth = simulate(robot, skin, k, what, setup.seed)
    else:
        said = recorded(recording, skin, robot.posture(robot.home), k)
        k, depth = said.sensor, skin.believed(*said)
    sensor = skin.sensors[k]
    row = judge_wall(depth, sensor) if what == "wall" else judge_hand(depth, sensor)
    ok = float(bool(row.pop("agrees")))
    if words:
        row["port"] = words
    check = Check("agrees with the layout", ok, "", 1.0, at_least=True)
    return Report(f"skin check {what}", setup.seed, [{"name": sensor.name} | row], [check])


def judge_wall(depth: Array, sensor: Sensor) -> dict[str, Any]:
    """Which reading of the ranges (F, n) makes a plane: depth along the axis, or the ray's?"""
    axial = zone_centres(sensor)
    radial = axial / np.linalg.norm(axial, axis=1, keepdims=True)
    enough = np.isfinite(depth).sum(axis=0) >= max(1, len(depth) // 2)
    if enough.sum() < FEWEST:
        raise SensorError(f"{int(enough.sum())} zones see a wall; hold it nearer, {FEWEST} need to")
    z = np.nanmedian(depth[:, enough], axis=0)
    rms = {
        name: _off_plane(z[:, None] * rays[enough])
        for name, rays in ((PERPENDICULAR, axial), (RADIAL, radial))
    }
    best = min(rms, key=lambda name: rms[name])
    other = max(rms.values()) / max(rms[best], 1e-9)
    said = best if other > SURE else "uncertain"
    return {
        "convention": said, "perpendicular_rms_m": rms[PERPENDICULAR], "radial_rms_m": rms[RADIAL],
        "zones": int(enough.sum()), "agrees": said == sensor.type.range,
    }  # fmt: skip


def judge_hand(depth: Array, sensor: Sensor) -> dict[str, Any]:
    """How the zones are mirrored and turned, from a hand that goes right, then down."""
    track = []
    for frame in depth:
        if np.isfinite(frame).any():
            near = frame <= np.nanmin(frame) + 0.05 + sensor.type.noise(np.nanmin(frame))
            row, column = np.divmod(np.flatnonzero(near), sensor.type.columns)
            track.append((column.mean(), row.mean()))
        else:
            track.append((np.nan, np.nan))
    half = len(track) // 2
    ways = [_way(np.array(part)) for part in (track[:half], track[half:])]
    found = []
    for mirrored in (False, True):
        for turn in (0, 90, 180, 270):
            R = np.round([[_cos(turn), -_sin(turn)], [_sin(turn), _cos(turn)]])
            M = R @ np.diag([-1.0 if mirrored else 1.0, 1.0])
            score = min((M @ ways[0])[0], (M @ ways[1])[1])
            found.append((float(score), turn, mirrored))
    score, turn, mirrored = max(found)
    if score < LOOSE:
        raise SensorError(
            "the hand's way is not clear; move it once from left to right, then once from top "
            "to bottom, as seen from the sensor, each for half of the recording"
        )
    agrees = (turn, mirrored) == (sensor.rotation_deg, sensor.mirrored)
    return {
        "rotation_deg": turn, "mirrored": mirrored, "layout_rotation_deg": sensor.rotation_deg,
        "layout_mirrored": sensor.mirrored, "clarity": score, "agrees": agrees,
    }  # fmt: skip


def simulate(robot: Any, skin: Skin, k: int, what: str, seed: int) -> Array:
    """Reports (F, n) [m] of sensor k before a wall, or a ball that goes right, then down."""
    posture = robot.posture(robot.home)
    T = posture.T_base_link[skin.link[k]] @ skin.sensors[k].T_link_sensor
    world = World(())
    if what == "wall":
        tilt = np.eye(4)
        c, s = np.cos(0.2), np.sin(0.2)
        tilt[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
        tilt[2, 3] = 0.4
        world.add("wall", {"kind": "box", "size_m": [2.0, 2.0, 0.01]}, (0, 0, 0))
        places = [T @ tilt] * 30
        name = "wall"
    else:
        view = np.radians(min(skin.sensors[k].type.field_of_view_deg))
        reach = 0.4 * np.tan(0.4 * view)
        name = "hand"
        world.add(name, {"kind": "sphere", "radius_m": 0.04}, (0, 0, 0))
        places = []
        for axis in (0, 1):
            for share in np.linspace(-1.0, 1.0, 30):
                at = np.eye(4)
                at[axis, 3], at[2, 3] = share * reach, 0.4
                places.append(T @ at)
    eye = SimulatedSkin(robot, skin, world, seed, ErrorModel(bias=1.0 / 3.0), latency=0.0)
    out = []
    for i, place in enumerate(places):
        world.move(name, place)
        for f in eye.poll(i / 15.0, posture) + eye.poll((i + 0.999) / 15.0, posture):
            if f.sensor == k:
                out.append(skin.believed(k, f.distance, f.status, f.targets))
    return np.array(out)


def _prompt(sentence: str) -> None:
    print(sentence, file=sys.stderr)


def _off_plane(points: Array) -> float:
    """Root mean square distance [m] of points to their best plane, the worst tenth left out."""
    centred = points - points.mean(axis=0)
    off = np.abs(centred @ np.linalg.svd(centred)[2][2])
    keep = off <= np.quantile(off, 0.9)
    rest = points[keep] - points[keep].mean(axis=0)
    return float(np.linalg.svd(rest)[1][2] / np.sqrt(keep.sum()))


def _way(track: Array) -> Array:
    """Unit direction (2,) in columns and rows of a track (F, 2)."""
    track = track[np.isfinite(track).all(axis=1)]
    if len(track) < FEWEST // 2:
        raise SensorError(f"{len(track)} frames show a hand; {FEWEST} are needed in all")
    slope = np.polyfit(np.arange(len(track)), track, 1)[0]
    return np.asarray(slope / max(float(np.linalg.norm(slope)), 1e-9))


def _cos(degrees: int) -> float:
    return float(np.cos(np.radians(degrees)))


def _sin(degrees: int) -> float:
    return float(np.sin(np.radians(degrees)))
