"""The arm and its sensors.

Meshes are sent once, under /robot/<link>, and only the links' poses are assigned after that.
Sensors hang under their links and move for free; a sensor's colour tells its health.
"""

from math import radians

import numpy as np
import viser

from app.messages import SensorHealth, Snapshot
from app.ui.colours import HEALTH
from app.ui.engine import Engine
from app.ui.scene.poses import wxyz
from app.ui.scene.switch import Switch

FIELD_OF_VIEW = radians(45.0)  # a side of the square field of view (VL53L5CX datasheet, 45 deg)
FRUSTUM = 0.022  # [m] drawn length of a sensor's field of view


class RobotView:
    """Posed links and health-coloured sensors."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        scene = server.scene
        self._links = [
            scene.add_mesh_trimesh(f"/robot/{link}", engine.robot.visual(link))
            for link in engine.robot.links
        ]
        self._sensors = [
            scene.add_camera_frustum(
                f"/robot/{sensor.link}/{sensor.name}",
                fov=FIELD_OF_VIEW,
                aspect=1.0,
                scale=FRUSTUM,
                thickness=0.0008,
                color=HEALTH[SensorHealth.ABSENT],
                variant="filled",
                cast_shadow=False,
                receive_shadow=False,
                wxyz=wxyz(sensor.T_link_sensor),
                position=sensor.T_link_sensor[:3, 3],
            )
            for sensor in engine.skin.sensors
        ]
        self._health = np.full(len(self._sensors), -1, dtype=np.int16)

    def update(self, snapshot: Snapshot) -> None:
        poses = snapshot.T_base_link
        turns = wxyz(poses)
        for handle, T, q in zip(self._links, poses, turns, strict=True):
            handle.position, handle.wxyz = T[:3, 3], q
        for k in np.flatnonzero(snapshot.health != self._health):
            self._sensors[k].color = HEALTH[SensorHealth(int(snapshot.health[k]))]
        self._health[:] = snapshot.health

    def switches(self) -> list[Switch]:
        return [
            Switch("Arm", True, lambda on: _show(self._links, on)),
            Switch("Sensors", True, lambda on: _show(self._sensors, on), "coloured by health"),
        ]


def _show(handles: list[viser.GlbHandle] | list[viser.CameraFrustumHandle], on: bool) -> None:
    for handle in handles:
        handle.visible = on
