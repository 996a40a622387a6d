"""How other packages cast rays at an arm and find its nearest points, each at its best.

A ray caster is made from bodies and answers (n,) [m] for poses (L, 4, 4), origins and unit
directions (n, 3), all in the base frame; +inf is a miss. A distance finder answers (L,) [m]
unsigned for poses and points (n, 3). Peers pay for pose updates.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.bench.perception import Scene, timed
from app.messages import Array
from app.robot.meshes import BodyMesh
from app.robot.model import Robot

Bodies = Sequence[BodyMesh]
Cast = Callable[[Array, Array, Array], Array]
Nearest = Callable[[Array, Array], Array]


def _posed(bodies: Bodies, T: Array) -> tuple[Array, Any]:
    vertices, faces, n = [], [], 0
    for b, pose in zip(bodies, T, strict=True):
        vertices.append(b.vertices @ pose[:3, :3].T + pose[:3, 3])
        faces.append(b.faces + n)
        n += len(b.vertices)
    return np.concatenate(vertices), np.concatenate(faces)


def _local(T: Array, points: Array) -> Array:
    return (points - T[:3, 3]) @ T[:3, :3]


def trimesh_rebuilt(bodies: Bodies) -> Cast:
    """The paper's way: a new tree of the posed mesh every time."""

    def cast(T: Array, origins: Array, directions: Array) -> Array:
        mesh = trimesh.Trimesh(*_posed(bodies, T), process=False)
        at, ray, _ = mesh.ray.intersects_location(origins, directions, multiple_hits=False)
        out = np.full(len(origins), np.inf)
        out[ray] = np.linalg.norm(at - origins[ray], axis=1)
        return out

    return cast


def igl_links(bodies: Bodies) -> Nearest:
    """libigl's tree of every link, built once; all points are asked."""
    import igl

    trees = []
    for b in bodies:
        tree, vertices, faces = igl.AABB(), np.array(b.vertices), np.array(b.faces)
        tree.init(vertices, faces)
        trees.append((tree, vertices, faces))

    def nearest(T: Array, points: Array) -> Array:
        out = []
        for (tree, vertices, faces), pose in zip(trees, T, strict=True):
            squared = tree.squared_distance(vertices, faces, _local(pose, points))
            squared = squared[0] if isinstance(squared, tuple) else squared
            out.append(np.sqrt(np.min(squared)))
        return np.array(out)

    return nearest


def coal_points(bodies: Bodies) -> Nearest:
    """coal, a sphere of no size for each point and each link."""
    import coal

    models = []
    for b in bodies:
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(b.faces), len(b.vertices))
        model.addVertices(np.asarray(b.vertices))
        model.addTriangles(np.asarray(b.faces))
        model.endModel()
        models.append(model)
    ball, request = coal.Sphere(1e-9), coal.DistanceRequest()

    def nearest(T: Array, points: Array) -> Array:
        out = []
        for model, pose in zip(models, T, strict=True):
            here = coal.Transform3s(pose[:3, :3], pose[:3, 3])
            out.append(
                min(
                    coal.distance(
                        model, here, ball, coal.Transform3s(np.eye(3), p), request,
                        coal.DistanceResult(),
                    )
                    for p in points
                )
            )  # fmt: skip
        return np.array(out)

    return nearest


def fcpw_points(bodies: Bodies) -> Nearest:
    """fcpw's scene of every link, all points in one call."""
    import fcpw

    scenes = []
    for b in bodies:
        scene = fcpw.scene_3D()
        scene.set_object_count(1)
        scene.set_object_vertices(b.vertices.astype(np.float32), 0)
        scene.set_object_triangles(b.faces.astype(np.int32), 0)
        scene.build(fcpw.aggregate_type.bvh_surface_area, True, False, False)
        scenes.append(scene)

    def nearest(T: Array, points: Array) -> Array:
        out = []
        for scene, pose in zip(scenes, T, strict=True):
            found = fcpw.interaction_3D_list()
            far = np.full(len(points), np.inf, dtype=np.float32)
            scene.find_closest_points(_local(pose, points).astype(np.float32), far, found)
            out.append(min(i.d for i in found))
        return np.array(out)

    return nearest


def trimesh_points(bodies: Bodies) -> Nearest:
    """trimesh's proximity queries."""
    meshes = [trimesh.Trimesh(b.vertices, b.faces, process=False) for b in bodies]

    def nearest(T: Array, points: Array) -> Array:
        return np.array(
            [
                trimesh.proximity.closest_point(m, _local(pose, points))[1].min()
                for m, pose in zip(meshes, T, strict=True)
            ]
        )

    return nearest


def roboplan_filter(
    robot: Robot, method: str, padding: float, scene: Scene, clouds: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """roboplan's RobotBodyFilter: seconds of a call, and which points (P, n) it removes.

    scene, clouds: P postures and their points (P, n, 3) [m], base frame.
    """
    import roboplan.core as roboplan

    urdf = next(robot.folder.glob("*.urdf"))
    arm = roboplan.Scene("arm", roboplan.loadUrdfSceneDescription(str(urdf), [str(robot.folder)]))
    kind = getattr(roboplan.RobotBodyFilterMethod, method)
    options = roboplan.RobotBodyFilterOptions(padding, kind, num_threads=1)
    judge = roboplan.RobotBodyFilter(arm, options)
    q = [np.array(posture.q) for posture, _ in scene]
    seconds = timed(lambda i: judge.computeMask(q[i % len(q)], clouds[i % len(q)]), 200)
    found = [judge.computeMask(a, b) for a, b in zip(q, clouds, strict=True)]
    return seconds, np.array(found, dtype=bool)


# name, module, maker, timed calls
RAYS: tuple[tuple[str, str, Callable[[Bodies], Cast], int], ...] = (
    ("trimesh + embreex, rebuilt (the paper)", "embreex", trimesh_rebuilt, 10),
)
# name, module, maker, most points that it is asked for
DISTANCES: tuple[tuple[str, str, Callable[[Bodies], Nearest], int], ...] = (
    ("igl", "igl", igl_links, 10_000),
    ("coal", "coal", coal_points, 10_000),
    ("fcpw", "fcpw", fcpw_points, 10_000),
    ("trimesh", "trimesh", trimesh_points, 100),
)
