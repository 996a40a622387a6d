"""The arm and its sensors.

Meshes are sent once, under /robot/<link>, and only these frames' poses are assigned after that.
The sensors of a link are one batched mesh under it and move for free; a node for each of
thirty sensors cost a browser without a graphics card a third of every picture.
"""

from dataclasses import dataclass
from math import radians, tan

import numpy as np
import viser
from numpy.typing import NDArray

from app.messages import SensorHealth, Snapshot
from app.ui.colours import HEALTH
from app.ui.engine import Engine
from app.ui.scene.poses import Nodes, wxyz
from app.ui.scene.switch import Switch

HALF_VIEW = radians(22.5)  # half a side of the square field of view (UM3109: 45 degrees)
HORN = 0.025  # [m] drawn length of a sensor's field of view
COLOURS = np.array([HEALTH[h] for h in SensorHealth], dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class _Patch:
    """The sensors of one link: their indices in the skin and their one handle."""

    sensors: NDArray[np.intp]
    handle: viser.BatchedMeshHandle


class RobotView:
    """Posed links and health-coloured sensors."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        names, scene = engine.robot.links, server.scene
        self.links = [scene.add_frame(f"/robot/{link}", show_axes=False) for link in names]
        self._nodes = Nodes(self.links)
        self.meshes = [
            scene.add_mesh_trimesh(f"/robot/{link}/mesh", engine.robot.visual(link))
            for link in names
        ]
        sensors = engine.skin.sensors
        wearers = dict.fromkeys(s.link for s in sensors)
        self.patches = [_patch(server, engine, link) for link in wearers]
        self._health = np.full(len(sensors), SensorHealth.ABSENT, dtype=np.uint8)

    def update(self, snapshot: Snapshot) -> None:
        self._nodes.show(snapshot.T_base_link)
        if not np.array_equal(snapshot.health, self._health):
            self._health = snapshot.health.copy()
            for patch in self.patches:
                patch.handle.batched_colors = COLOURS[snapshot.health[patch.sensors]]

    def switches(self) -> list[Switch]:
        return [
            Switch("Arm", True, self._show_meshes),
            Switch("Sensors", True, self._show_sensors, "coloured by health"),
        ]

    def _show_meshes(self, on: bool) -> None:
        for mesh in self.meshes:
            mesh.visible = on

    def _show_sensors(self, on: bool) -> None:
        for patch in self.patches:
            patch.handle.visible = on


def _patch(server: viser.ViserServer, engine: Engine, link: str) -> _Patch:
    mine = [k for k, s in enumerate(engine.skin.sensors) if s.link == link]
    poses = np.array([engine.skin.sensors[k].T_link_sensor for k in mine])
    half = HORN * tan(HALF_VIEW)
    rim = [[-half, -half, HORN], [half, -half, HORN], [half, half, HORN], [-half, half, HORN]]
    handle = server.scene.add_batched_meshes_simple(
        f"/robot/{link}/sensors",
        vertices=np.array([[0.0, 0.0, 0.0], *rim]),
        faces=np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]),
        batched_wxyzs=wxyz(poses),
        batched_positions=poses[:, :3, 3],
        batched_colors=np.tile(COLOURS[SensorHealth.ABSENT], (len(mine), 1)),
        lod="off",
        flat_shading=True,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )
    return _Patch(np.array(mine, dtype=np.intp), handle)
