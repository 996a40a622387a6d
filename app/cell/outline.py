"""The cell's boxes as corners, edges and faces; and where its ground is."""

from itertools import product

import numpy as np

from app.cell.parts import Box, Cell
from app.messages import Array

CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
EDGES = [(i, j) for i in range(8) for j in range(i) if np.abs(CORNERS[i] - CORNERS[j]).sum() == 1.0]
FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip
UPRIGHT = 0.9  # of a plane's z axis along the base's: the plane is a floor


def outline(box: Box) -> Array:
    """(12, 2, 3) [m] the edges of a box, base frame."""
    corners = (CORNERS * box.size) @ box.T_base_box[:3, :3].T + box.T_base_box[:3, 3]
    return np.asarray(corners[EDGES])


def bottom_of(cell: Cell) -> float:
    """Height [m] of the cell's lowest floor, or of what its boxes stand on, base frame."""
    level = [p.T_base_plane for p in cell.planes if p.T_base_plane[2, 2] > UPRIGHT]
    heights = [float(T[2, 3]) for T in level]
    return min(heights or [float(outline(box)[..., 2].min()) for box in cell.boxes], default=0.0)
