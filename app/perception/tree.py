"""One bounding-volume tree a body link, built once, laid out flat for the compiled search.

A node's box is turned along the mean normal of its faces: a patch of a curved surface is
thin across, so the boxes stay apart where axis-aligned ones would overlap, and the number of
nodes that a search visits grows with the logarithm of the faces (PQP and Coal turn their
boxes for the same reason).

Sign comes from angle-weighted pseudonormals of the nearest face, edge or vertex (Baerentzen
and Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005), exact
for closed surfaces. A link whose mesh is not closed has unsigned distances.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.meshes import BodyMesh

LEAF = 4  # faces in a leaf
FLAT = 0.5  # faces whose mean normal is at least this long are boxed along it
ROUNDING = 2e-7  # [m] boxes are this much larger than float32 says


class Forest(NamedTuple):
    """Flat trees of L links, N nodes and F faces in all, each in its link's frame.

    box: (N, 15) float32: three unit axes, the box's centre along them, its half lengths [m].
    child: (N,) first of two neighbouring children, or the first face of a leaf.
    faces: (N,) faces of a leaf, 0 for a node with children.   root: (L,) node.
    corners: (F, 3, 3) [m].
    normals: (F, 7, 3) pseudonormals of the face, its three vertices and its edges ab, bc, ca.
    low, high: (L, 3) [m] axis-aligned box of each link.   closed: (L,) bool.
    """

    box: NDArray[np.float32]
    child: NDArray[np.int64]
    faces: NDArray[np.int64]
    root: NDArray[np.int64]
    corners: Array
    normals: Array
    low: Array
    high: Array
    closed: NDArray[np.bool_]


def plant(bodies: Sequence[BodyMesh]) -> Forest:
    """Build the trees of `bodies`; faces without area are left out."""
    trees = [_tree(b) for b in bodies]
    nodes = np.cumsum([0] + [len(t[0]) for t in trees])
    faces = np.cumsum([0] + [len(t[3]) for t in trees])
    box, child, count, corners, normals = (
        np.concatenate([t[i] for t in trees]) for i in range(5)
    )  # fmt: skip
    for i in range(len(trees)):
        span = slice(nodes[i], nodes[i + 1])
        child[span] += np.where(count[span] > 0, faces[i], nodes[i])
    return Forest(
        box=box,
        child=child,
        faces=count,
        root=nodes[:-1].astype(np.int64),
        corners=corners,
        normals=normals,
        low=np.array([t[3].min(axis=(0, 1)) for t in trees]),
        high=np.array([t[3].max(axis=(0, 1)) for t in trees]),
        closed=np.array([t[5] for t in trees]),
    )


def _tree(
    body: BodyMesh,
) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.int64], Array, Array, bool]:
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=True)  # merges equal vertices
    mesh.update_faces(mesh.nondegenerate_faces(height=1e-9))
    corners = np.array(mesh.triangles, dtype=np.float64)
    normals = _pseudonormals(mesh)
    order = np.arange(len(corners))
    box = np.empty((2 * len(corners), 15), dtype=np.float32)
    child, count = np.empty(len(box), dtype=np.int64), np.zeros(len(box), dtype=np.int64)
    n = _grow(corners, corners.mean(axis=1), order, box, child, count)
    return (
        box[:n].copy(),
        child[:n].copy(),
        count[:n].copy(),
        np.ascontiguousarray(corners[order]),
        np.ascontiguousarray(normals[order]),
        bool(mesh.is_watertight),
    )


@compiled
def _grow(
    corners: Array,
    centres: Array,
    order: NDArray[np.int64],
    box: NDArray[np.float32],
    child: NDArray[np.int64],
    count: NDArray[np.int64],
) -> int:
    """Split faces at the median along their widest axis; returns the number of nodes.

    Sorts `order` (F,) and writes box, child and count as in `Forest`, for one tree.
    """
    first, last = np.empty(len(box), dtype=np.int64), np.empty(len(box), dtype=np.int64)
    first[0], last[0] = 0, len(corners)
    nodes = 1
    node = 0
    while node < nodes:
        mine = order[first[node] : last[node]]
        _fit(corners, mine, box[node])
        if len(mine) <= LEAF:
            child[node], count[node] = first[node], len(mine)
        else:
            axis, widest = 0, -1.0
            for a in range(3):
                c = centres[mine, a]
                if c.max() - c.min() > widest:
                    axis, widest = a, c.max() - c.min()
            mine[:] = mine[np.argsort(centres[mine, axis])]
            half = first[node] + len(mine) // 2
            child[node] = nodes
            first[nodes], last[nodes] = first[node], half
            first[nodes + 1], last[nodes + 1] = half, last[node]
            nodes += 2
        node += 1
    return nodes


@compiled
def _fit(corners: Array, mine: NDArray[np.int64], box: NDArray[np.float32]) -> None:
    """Write the box (15,) of some faces: turned along their mean normal, where they have one."""
    normal, area = np.zeros(3), 0.0
    for f in mine:
        u, v = corners[f, 1] - corners[f, 0], corners[f, 2] - corners[f, 0]
        n = np.array(
            [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        )
        normal += n
        area += np.sqrt((n * n).sum())
    axes = np.eye(3)
    length = np.sqrt((normal * normal).sum())
    if length > FLAT * area:
        normal /= length
        least = np.argmin(np.abs(normal))
        u = np.zeros(3)
        u[least] = 1.0
        u -= normal[least] * normal
        u /= np.sqrt((u * u).sum())
        v = np.array(
            [
                normal[1] * u[2] - normal[2] * u[1],
                normal[2] * u[0] - normal[0] * u[2],
                normal[0] * u[1] - normal[1] * u[0],
            ]
        )
        # turn u and v along the spread of the corners in the plane
        mean_u, mean_v, n_corners = 0.0, 0.0, 3.0 * len(mine)
        for f in mine:
            for c in range(3):
                mean_u += (corners[f, c] * u).sum() / n_corners
                mean_v += (corners[f, c] * v).sum() / n_corners
        uu, vv, uv = 0.0, 0.0, 0.0
        for f in mine:
            for c in range(3):
                a, b = (corners[f, c] * u).sum() - mean_u, (corners[f, c] * v).sum() - mean_v
                uu += a * a
                vv += b * b
                uv += a * b
        turn = 0.5 * np.arctan2(2.0 * uv, uu - vv)
        axes[0] = np.cos(turn) * u + np.sin(turn) * v
        axes[1] = -np.sin(turn) * u + np.cos(turn) * v
        axes[2] = normal
    for a in range(3):
        for i in range(3):
            box[3 * a + i] = axes[a, i]
    for a in range(3):  # along the axes as float32 has rounded them
        low, high = np.inf, -np.inf
        for f in mine:
            for c in range(3):
                along = 0.0
                for i in range(3):
                    along += box[3 * a + i] * corners[f, c, i]
                low, high = min(low, along), max(high, along)
        box[9 + a] = 0.5 * (low + high)
        half = max(high - box[9 + a], box[9 + a] - low)
        box[12 + a] = half * (1.0 + ROUNDING) + ROUNDING


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
