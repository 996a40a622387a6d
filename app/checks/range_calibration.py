"""`flinch calibrate ranges`: each zone's error, from walls at known distances."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot_and_skin, lay_out
from app.errors import SensorError
from app.messages import Array, SensorFrame
from app.report import Report
from app.robot.model import Robot
from app.robot.ranges import RangeTable, load_ranges, save_ranges, wall_offset, with_wall
from app.robot.skin import Skin, zone_centres
from app.sensing.budget import IDEAL, Budget, read_budget
from app.sensing.replays import recorded
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.world.motion import Still
from app.world.shapes import shape_of
from app.world.tables import PanelShape
from app.world.world import Body, World

FRAMES = 150  # of a simulated wall: ten seconds
DISTANCES = (0.05, 0.1, 0.2, 0.6)  # [m] of the simulated walls
LIGHT = 0.8  # reflectance of the simulated walls
SQUARE = 2.0  # [degrees] a wall may be turned


def calibrate_ranges(setup: Setup, recording: str, distance: float, file: Path) -> Report:
    """Add walls to the table in `file`: one recorded, PATH[@SENSOR] at `distance` [m], or, with
    'simulated', those of all sensors of the simulation with the setup's seed.
    """
    robot, skin = build_robot_and_skin(setup)
    table = load_ranges(file, skin.slots) if file.exists() else None
    if recording == "simulated":
        walls = simulated_walls(robot, lay_out(robot), setup.seed, read_budget(setup.world))
    else:
        if not distance > 0.0:
            raise SensorError("a recorded wall needs its --distance in metres from the lens")
        said = recorded(recording, skin, robot.posture(robot.home))
        walls = [(said.sensor, distance, skin.believed(*said))]
    rows = []
    for k, d, depth in walls:
        rows.append({"name": skin.sensors[k].name} | _row(skin, k, d, depth))
        offset = wall_offset(depth * skin.depth[skin.zones(k)], d)
        table = with_wall(table, skin.first, k, d, offset)
    assert table is not None
    save_ranges(file, table)
    return Report("calibrate ranges", setup.seed, rows)


def simulated_walls(
    robot: Robot, skin: Skin, seed: int, budget: Budget = IDEAL
) -> list[tuple[int, float, Array]]:
    """Sensor, distance [m] and reports (F, n) [m] of light walls that somebody held square before
    every sensor, wherever that truly is."""
    shape = shape_of(PanelShape((3.0, 3.0), 0.01), Path(), "wall")
    world = World((Body("wall", shape, (0, 0, 0), Still(np.eye(4)), True, LIGHT),))
    eye, out = SimulatedSkin(robot, skin, world, seed, latency=0.0, budget=budget), []
    posture, now = eye.truth.robot.posture(robot.home), 0.0
    for k, sensor in enumerate(eye.truth.skin.sensors):
        eye.muted = set(range(skin.count)) - {k}
        for distance in DISTANCES:
            place = np.eye(4)
            place[2, 3] = distance + 0.005  # half of the wall's thickness
            world.move("wall", posture.T_base_link[skin.link[k]] @ sensor.T_link_sensor @ place)
            frames: list[SensorFrame] = []
            while len(frames) < FRAMES:
                now += sensor.type.period
                frames += eye.poll(now, posture)
            seen = [skin.believed(k, f.distance, f.status, f.targets) for f in frames]
            out.append((k, distance, np.array(seen)))
    return out


def table_of(walls: list[tuple[int, float, Array]], first: NDArray[np.int64]) -> RangeTable:
    """All walls, depths (F, n) along the axis, in one table; first: (K + 1,) as the skin's."""
    table = None
    for k, distance, depth in walls:
        table = with_wall(table, first, k, distance, wall_offset(depth, distance))
    assert table is not None
    return table


def _row(skin: Skin, k: int, distance: float, depth: Array) -> dict[str, Any]:
    offset = wall_offset(depth * skin.depth[skin.zones(k)], distance)
    known = np.isfinite(offset)
    if not known.any():
        raise SensorError(
            f"{skin.sensors[k].name}: no zone sees the wall at {distance:g} m; show it a flat, "
            "light wall for at least two seconds"
        )
    rays = zone_centres(skin.sensors[k])[known]
    z = distance - offset[known]
    slope = np.linalg.lstsq(np.c_[np.ones(len(z)), z[:, None] * rays[:, :2]], z, rcond=None)[0]
    tilt = float(np.degrees(np.arctan(np.hypot(slope[1], slope[2]))))
    share = 100 * offset[known] / distance
    return {
        "distance_m": distance, "zones": int(known.sum()), "mean_percent": float(share.mean()),
        "spread_percent": float(share.std()), "tilt_deg": tilt,
        "note": "" if tilt <= SQUARE else "turn the wall square to the sensor and repeat",
    }  # fmt: skip
