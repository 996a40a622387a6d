"""The arm and its sensors.

Meshes are sent once, under /robot/<link>, and only these frames' poses are assigned after that.
The sensors of a link whose fields of view are alike are one batched mesh under it and move for
free; a node for each of thirty sensors cost a browser without a graphics card a third of every
picture.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from app.messages import Array, SensorHealth, Snapshot
from app.robot.skin import Sensor, zone_directions
from app.ui.colours import ARM, CALM, HEALTH
from app.ui.engine import Engine
from app.ui.scene.poses import Nodes, wxyz
from app.ui.scene.switch import Sign, Switch

HORN = 0.025  # [m] drawn length of a sensor's field of view
View = tuple[float, float]
COLOURS = np.array([HEALTH[h] for h in SensorHealth], dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class _Patch:
    """Sensors of one link with one field of view: their indices in the skin and their handle."""

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
        self.patches = [
            _patch(server, engine, f"/robot/{link}/sensors{'' if i == 0 else f'-{i + 1}'}", mine, v)
            for link, views in alike(sensors).items()
            for i, (v, mine) in enumerate(views.items())
        ]
        self._health = np.full(len(sensors), SensorHealth.ABSENT, dtype=np.uint8)

    def update(self, snapshot: Snapshot) -> None:
        self._nodes.show(snapshot.T_base_link)
        if not np.array_equal(snapshot.health, self._health):
            self._health = snapshot.health.copy()
            for patch in self.patches:
                patch.handle.batched_colors = COLOURS[snapshot.health[patch.sensors]]

    def switches(self) -> list[Switch]:
        return [
            Switch("Arm", True, self._show_meshes, "the arm as it is now", Sign(ARM)),
            Switch("Sensors", True, self._show_sensors, "coloured by health", Sign(CALM)),
        ]

    def _show_meshes(self, on: bool) -> None:
        for mesh in self.meshes:
            mesh.visible = on

    def _show_sensors(self, on: bool) -> None:
        for patch in self.patches:
            patch.handle.visible = on


def half_view(sensor: Sensor) -> View:
    """Half the sides of a sensor's field of view at unit depth, across and down, as mounted."""
    x, y, _ = zone_directions(sensor, np.array([-0.5]), np.array([-0.5]))[0]
    return round(abs(float(x)), 9), round(abs(float(y)), 9)


def alike(
    sensors: Sequence[Sensor], only: Collection[int] | None = None
) -> dict[str, dict[View, list[int]]]:
    """The sensors, by their index, of each link and of each field of view; all, or some only."""
    out: dict[str, dict[View, list[int]]] = {}
    for k, s in enumerate(sensors):
        if only is None or k in only:
            out.setdefault(s.link, {}).setdefault(half_view(s), []).append(k)
    return out


def horn(view: View, length: float) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (5, 3) and faces (4, 3) of a field of view up to `length` [m], sensor frame."""
    x, y = length * view[0], length * view[1]
    rim = [[-x, -y, length], [x, -y, length], [x, y, length], [-x, y, length]]
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    return np.array([[0.0, 0.0, 0.0], *rim]), faces


def _patch(
    server: viser.ViserServer, engine: Engine, name: str, mine: list[int], view: View
) -> _Patch:
    poses = np.array([engine.skin.sensors[k].T_link_sensor for k in mine])
    vertices, faces = horn(view, HORN)
    handle = server.scene.add_batched_meshes_simple(
        name,
        vertices=vertices,
        faces=faces,
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
