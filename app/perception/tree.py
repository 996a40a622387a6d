"""One bounding-volume tree a body link, built once, laid out flat for the compiled search.

A node has eight children and a leaf four faces, so that vector instructions look at all of them
at once. A child's box is turned along the mean normal of its faces: a patch of a curved surface
is thin across, so the boxes stay apart where axis-aligned ones would overlap, and the number of
nodes that a search visits grows with the logarithm of the faces (PQP and Coal turn their boxes
for the same reason).

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

WIDE, LEAF = 8, 8  # children of a node, faces of a leaf
FLAT = 0.5  # faces whose mean normal is at least this long are boxed along it
ROUNDING = 2e-7  # [m] boxes are this much larger than float32 says
NOWHERE = 1e18  # [m] where the box of a child lies that does not exist


class Forest(NamedTuple):
    """Flat trees of L links, N nodes and F faces in all, each in its link's frame.

    box: (N, 15, 8) float32, of each child: three unit axes, the centre of its box along them,
         its half lengths [m].
    child: (N, 8) node, or -1 - leaf.   root: (L,) node.
    leaf: (F / 4, 13, 4) of each face a, b, c: a, ab, ac, 1 / |ab|^2, 1 / |ac|^2, 1 / |bc|^2 and
          1 / |ab x ac|^2.
    corners: (F, 3, 3) [m].   normals: (F, 7, 3) pseudonormals of the face, its three vertices
             and its edges ab, bc, ca. A leaf that is not full repeats its last face.
    low, high: (L, 3) [m] axis-aligned box of each link.   closed: (L,) bool.
    """

    box: NDArray[np.float32]
    child: NDArray[np.int64]
    root: NDArray[np.int64]
    leaf: Array
    corners: Array
    normals: Array
    low: Array
    high: Array
    closed: NDArray[np.bool_]


class _Tree(NamedTuple):
    """As in `Forest`, of one link."""

    box: NDArray[np.float32]
    child: NDArray[np.int64]
    corners: Array
    normals: Array
    closed: bool


def plant(bodies: Sequence[BodyMesh]) -> Forest:
    """Build the trees of `bodies`; faces without area are left out."""
    trees = [_tree(b) for b in bodies]
    root = np.cumsum([0] + [len(t.box) for t in trees])
    leaves = np.cumsum([0] + [len(t.corners) // LEAF for t in trees])
    child = [
        np.where(t.child < 0, t.child - leaf, t.child + node)
        for t, node, leaf in zip(trees, root[:-1], leaves[:-1], strict=True)
    ]
    corners = np.concatenate([t.corners for t in trees])
    return Forest(
        box=np.concatenate([t.box for t in trees]),
        child=np.concatenate(child),
        root=root[:-1].astype(np.int64),
        leaf=_leaves(corners.reshape(-1, LEAF, 3, 3)),
        corners=corners,
        normals=np.concatenate([t.normals for t in trees]),
        low=np.array([t.corners.min(axis=(0, 1)) for t in trees]),
        high=np.array([t.corners.max(axis=(0, 1)) for t in trees]),
        closed=np.array([t.closed for t in trees]),
    )


def _leaves(corners: Array) -> Array:
    """The `leaf` of a forest from the corners (F / 4, 4, 3, 3) of its faces."""
    a, ab, ac = (
        corners[:, :, 0],
        corners[:, :, 1] - corners[:, :, 0],
        corners[:, :, 2] - corners[:, :, 0],
    )
    squares = [(v * v).sum(axis=2) for v in (ab, ac, ac - ab, np.cross(ab, ac))]
    parts = [*np.moveaxis(np.concatenate((a, ab, ac), axis=2), 2, 0), *(1.0 / s for s in squares)]
    return np.stack(parts, axis=1)


def _tree(body: BodyMesh) -> _Tree:
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=True)  # merges equal vertices
    mesh.update_faces(mesh.nondegenerate_faces(height=1e-9))
    corners = np.array(mesh.triangles, dtype=np.float64)
    order = np.arange(len(corners))
    box = np.empty((len(corners), 15, WIDE), dtype=np.float32)
    child = np.empty((len(corners), WIDE), dtype=np.int64)
    span = np.empty((len(corners), 2), dtype=np.int64)
    nodes, leaves = _grow(corners, corners.mean(axis=1), order, box, child, span)
    first, last = span[:leaves, :1], span[:leaves, 1:]
    faces = order[np.minimum(first + np.arange(LEAF), last - 1).ravel()]
    return _Tree(
        box[:nodes], child[:nodes], corners[faces], _pseudonormals(mesh)[faces],
        bool(mesh.is_watertight),
    )  # fmt: skip


@compiled
def _grow(
    corners: Array,
    centres: Array,
    order: NDArray[np.int64],
    box: NDArray[np.float32],
    child: NDArray[np.int64],
    span: NDArray[np.int64],
) -> tuple[int, int]:
    """Divide faces into up to eight parts, those again, down to leaves; nodes and leaves made.

    Sorts `order` (F,), writes box and child as in `Forest`, for one tree, and where the faces of
    each leaf begin and end in `order`: span (F, 2).
    """
    first, last = np.empty(len(box), dtype=np.int64), np.empty(len(box), dtype=np.int64)
    first[0], last[0] = 0, len(corners)
    part, one = np.empty((WIDE, 2), dtype=np.int64), np.empty(15, dtype=np.float32)
    nodes, leaves = 1, 0
    node = 0
    while node < nodes:
        part[0, 0], part[0, 1] = first[node], last[node]
        parts = _divide(corners, centres, order, part)
        for c in range(WIDE):
            child[node, c] = 0
            box[node, :, c] = 0.0
            box[node, 9, c] = NOWHERE
        for c in range(parts):
            a, b = part[c]
            _fit(corners, order[a:b], one)
            box[node, :, c] = one
            if b - a <= LEAF:
                child[node, c] = -1 - leaves
                span[leaves] = part[c]
                leaves += 1
            else:
                child[node, c] = nodes
                first[nodes], last[nodes] = a, b
                nodes += 1
        node += 1
    return nodes, leaves


@compiled
def _divide(
    corners: Array, centres: Array, order: NDArray[np.int64], part: NDArray[np.int64]
) -> int:
    """Divide the faces of part[0] into halves, the largest first; how many parts (8, 2).

    No more than are needed for leaves that are nearly full.
    """
    ways = min(WIDE, (part[0, 1] - part[0, 0] + LEAF - 1) // LEAF)
    parts = 1
    while parts < ways:
        most = 0
        for c in range(parts):
            if part[c, 1] - part[c, 0] > part[most, 1] - part[most, 0]:
                most = c
        first, last = part[most]
        half = _halve(corners, centres, order[first:last])
        part[most, 1] = part[parts, 0] = first + half
        part[parts, 1] = last
        parts += 1
    return parts


@compiled
def _halve(corners: Array, centres: Array, mine: NDArray[np.int64]) -> int:
    """Sort faces along the axis at whose median the boxes of both halves are smallest."""
    half, least, best, box = len(mine) // 2, np.inf, mine.copy(), np.empty(15, dtype=np.float32)
    for axis in range(3):
        sorted_ = mine[np.argsort(centres[mine, axis])]
        area = 0.0
        for side in (sorted_[:half], sorted_[half:]):
            _fit(corners, side, box)
            area += box[12] * box[13] + box[13] * box[14] + box[14] * box[12]
        if area < least:
            least, best = area, sorted_
    mine[:] = best
    return half


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
