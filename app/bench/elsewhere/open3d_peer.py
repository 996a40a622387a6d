"""Open3D's RaycastingScene on the same rays and points; run by an environment of its own."""

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import open3d

job = np.load(sys.argv[1])
links = int(job["links"])
bodies = [(job[f"vertices_{i}"], job[f"faces_{i}"]) for i in range(links)]
poses = job["T_base_link"]  # (P, L, 4, 4)
answer: dict[str, Any] = {}


def scene_of(vertices: Any, faces: Any) -> Any:
    """A scene of one mesh, one thread."""
    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
    return scene


def posed(T: Any) -> tuple[Any, Any]:
    """The whole robot's mesh at a pose."""
    vertices, faces, n = [], [], 0
    for (v, f), pose in zip(bodies, T, strict=True):
        vertices.append(v @ pose[:3, :3].T + pose[:3, 3])
        faces.append(f + n)
        n += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def hits(scene: Any, origins: Any, directions: Any) -> Any:
    """Ray lengths (n,), +inf for a miss."""
    rays = np.concatenate((origins, directions), axis=1).astype(np.float32)
    return scene.cast_rays(rays, nthreads=1)["t_hit"].numpy()


def rebuilt(k: int) -> Any:
    """A new scene of the posed mesh every time."""
    return hits(scene_of(*posed(poses[k])), job["origins"][k], job["directions"][k])


def a_link(k: int) -> Any:
    """One scene a link, built once; the rays are moved."""
    best = np.full(job["origins"].shape[1], np.inf)
    for scene, pose in zip(scenes, poses[k], strict=True):
        local = (job["origins"][k] - pose[:3, 3]) @ pose[:3, :3]
        best = np.minimum(best, hits(scene, local, job["directions"][k] @ pose[:3, :3]))
    return best


def distances(points: Any) -> Callable[[int], Any]:
    """Smallest distance of every link to `points`, at the first pose."""

    def nearest(_: int) -> Any:
        out = []
        for scene, pose in zip(scenes, poses[0], strict=True):
            local = ((points - pose[:3, 3]) @ pose[:3, :3]).astype(np.float32)
            out.append(scene.compute_distance(local, nthreads=1).numpy().min())
        return np.array(out)

    return nearest


def timed(name: str, call: Callable[[int], Any], repeats: int, count: int) -> None:
    """Median seconds of a call, and its answers."""
    seconds = []
    for i in range(repeats // 5 + repeats):
        begin = time.perf_counter()
        call(i % count)
        seconds.append(time.perf_counter() - begin)
    answer[f"{name}_s"] = np.array(seconds[-repeats:])
    answer[f"{name}_answer"] = np.array([call(i) for i in range(count)])


scenes = [scene_of(*b) for b in bodies]
if "origins" in job:
    timed("rebuilt", rebuilt, 10, len(poses))
    timed("links", a_link, 100, len(poses))
for key in job.files:
    if key.startswith("points_"):
        timed(key, distances(job[key]), 10, 1)
np.savez(sys.argv[2], **answer)
