"""Meshes as glTF, which every viewer of these schemas draws from the message itself.

glTF's y axis points up, and viewers turn a model by a quarter of a turn so that it becomes z. Our
meshes are as they shall be seen, so they are turned the other way first.
"""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.colours import RGB
from app.messages import Array
from app.record.views.values import Fields, colour_of, pose_of, vector_of

MEDIA = "model/gltf-binary"
Z_TO_Y = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
HERE, FULL = pose_of(np.eye(4)), vector_of(np.ones(3))


def scene_glb(scene: Any) -> bytes:
    """A trimesh.Scene, z up, with its materials; the scene is not changed."""
    turned = scene.copy()
    turned.apply_transform(Z_TO_Y)
    glb: bytes = turned.export(file_type="glb")
    return glb


def mesh_glb(vertices: Array, faces: NDArray[np.int64]) -> bytes:
    """A mesh (V, 3) [m] and (F, 3) without a material; flat faces, since it has no normals."""
    mesh: Any = trimesh.Trimesh(vertices @ Z_TO_Y[:3, :3].T, faces, process=False)
    glb: bytes = mesh.export(file_type="glb", include_normals=False)
    return glb


def model(glb: bytes, colour: RGB | None = None, opacity: float = 1.0) -> Fields:
    """A `ModelPrimitive` at its frame's origin; a colour instead of the file's materials."""
    fields: Fields = {"pose": HERE, "scale": FULL, "media_type": MEDIA, "data": glb}
    if colour is not None:
        fields |= {"override_color": True, "color": colour_of(colour, opacity)}
    return fields
