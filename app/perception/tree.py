"""One bounding-volume tree a body link, built once, laid out flat for the compiled search.

All links share the same arrays; a link is known by the index of its root node. Sign comes
from angle-weighted pseudonormals of the nearest face, edge or vertex (Baerentzen and Aanaes,
"Signed distance computation using the angle weighted pseudonormal", 2005), exact for closed
surfaces. A link whose mesh is not closed has unsigned distances.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.messages import Array
from app.robot.meshes import BodyMesh

LEAF = 4  # faces in a leaf


class Forest(NamedTuple):
    """Flat trees of L links, N nodes and F faces in all, each in its link's frame.

    low, high: (N, 3) boxes.   child: (N,) first of two neighbouring children, -1 for a leaf.
    first, faces: (N,) faces of a leaf.   corners: (F, 3, 3) [m].
    normals: (F, 7, 3) pseudonormals of the face, its three vertices and its edges ab, bc, ca.
    root: (L,) node.   closed: (L,) bool.
    """

    low: Array
    high: Array
    child: NDArray[np.int64]
    first: NDArray[np.int64]
    faces: NDArray[np.int64]
    corners: Array
    normals: Array
    root: NDArray[np.int64]
    closed: NDArray[np.bool_]


def plant(bodies: Sequence[BodyMesh]) -> Forest:
    """Build the trees of `bodies`; faces without area are left out."""
    trees = [_tree(b) for b in bodies]
    nodes = np.cumsum([0] + [len(t[0]) for t in trees])
    faces = np.cumsum([0] + [len(t[5]) for t in trees])
    join = [np.concatenate([t[i] for t in trees]) for i in range(7)]
    for t, n, f in zip(range(len(trees)), nodes, faces, strict=False):
        span = slice(nodes[t], nodes[t + 1])
        join[2][span] += np.where(join[2][span] >= 0, n, 0)
        join[3][span] += f
    return Forest(
        low=join[0],
        high=join[1],
        child=join[2],
        first=join[3],
        faces=join[4],
        corners=join[5],
        normals=join[6],
        root=nodes[:-1].astype(np.int64),
        closed=np.array([t[7] for t in trees]),
    )


def _tree(body: BodyMesh) -> tuple[Array, Array, Array, Array, Array, Array, Array, bool]:
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=True)  # merges equal vertices
    mesh.update_faces(mesh.nondegenerate_faces(height=1e-9))
    corners = np.array(mesh.triangles, dtype=np.float64)
    normals = _pseudonormals(mesh)
    centres = corners.mean(axis=1)
    order = np.arange(len(corners))
    low, high, child, start, count = [], [], [], [], []

    def add(first: int, last: int) -> None:
        box = corners[order[first:last]].reshape(-1, 3)
        low.append(box.min(axis=0))
        high.append(box.max(axis=0))
        child.append(-1)
        start.append(first)
        count.append(last - first)

    add(0, len(order))
    node = 0
    while node < len(low):
        first, n = start[node], count[node]
        if n > LEAF:
            c = centres[order[first : first + n]]
            axis = int(np.argmax(c.max(axis=0) - c.min(axis=0)))
            half = n // 2
            part = np.argpartition(c[:, axis], half)
            order[first : first + n] = order[first : first + n][part]
            child[node], count[node] = len(low), 0
            add(first, first + half)
            add(first + half, first + n)
        node += 1
    return (
        np.array(low),
        np.array(high),
        np.array(child, dtype=np.int64),
        np.array(start, dtype=np.int64),
        np.array(count, dtype=np.int64),
        np.ascontiguousarray(corners[order]),
        np.ascontiguousarray(normals[order]),
        bool(mesh.is_watertight),
    )


def _pseudonormals(mesh: trimesh.Trimesh) -> Array:
    """(F, 7, 3): face, vertices a b c, edges ab bc ca. Lengths do not matter, only sides."""
    face = np.array(mesh.face_normals)
    vertex = np.zeros((len(mesh.vertices), 3))
    np.add.at(vertex, mesh.faces, mesh.face_angles[..., None] * face[:, None])
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)  # (F, 3, 2)
    key = edges[..., 0].astype(np.int64) * len(mesh.vertices) + edges[..., 1]
    unique, inverse = np.unique(key, return_inverse=True)
    edge = np.zeros((len(unique), 3))
    edge_of = inverse.reshape(-1, 3)
    np.add.at(edge, edge_of, np.broadcast_to(face[:, None], (len(face), 3, 3)))
    return np.concatenate([face[:, None], vertex[mesh.faces], edge[edge_of]], axis=1)
