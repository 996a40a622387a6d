"""Forward kinematics of a tree of joints as one compiled product of exponentials.

    T_base_link(q) = exp(S_1 q_1) ... exp(S_k q_k) T_base_link(0)

over the joints that carry the link; S_j is joint j's screw at q = 0, (linear at the base's
origin, angular), base frame (Brockett 1984; Murray, Li and Sastry, "A Mathematical Introduction
to Robotic Manipulation", 3.2). Column j of the spatial jacobian is the same screw where the
joints before it have carried it. What it needs comes from pinocchio once; asked of pinocchio
each time, link by link, the same took ten times as long.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array


class Chain(NamedTuple):
    """screw: (n, 6) at q = 0.   before: (n,) the joint that carries each, -1 for the base.
    carried: (F,) the joint that carries each frame, -1 for the base.
    T_base_frame: (F, 4, 4) at q = 0.
    """

    screw: Array
    before: NDArray[np.int64]
    carried: NDArray[np.int64]
    T_base_frame: Array


def chain(model: Any, frames: tuple[int, ...]) -> Chain:
    """Of some frames of a pinocchio model whose joints have one degree of freedom each."""
    data, zero = model.createData(), np.zeros(model.nq)
    pin.computeJointJacobians(model, data, zero)
    pin.updateFramePlacements(model, data)
    # the universe is joint 0 of pinocchio; the one joint of ours that is joint i there is idx_v
    ours = np.array([-1, *(j.idx_v for j in list(model.joints)[1:])])
    before = np.empty(model.nv, dtype=np.int64)
    for i in range(1, model.njoints):
        before[ours[i]] = ours[model.parents[i]]
    carried = np.array([ours[model.frames[f].parentJoint] for f in frames], dtype=np.int64)
    at_zero = np.array([data.oMf[f].homogeneous for f in frames])
    return Chain(np.ascontiguousarray(data.J.T), before, carried, at_zero)


@compiled
def place_chain(chain: Chain, q: Array, T_base_frame: Array, jacobian: Array) -> None:
    """Write the poses of all frames (F, 4, 4) and the spatial jacobian (6, n) at q (n,).

    A joint comes after those that carry it.
    """
    E, turn = np.empty((len(q), 4, 4)), np.empty((4, 4))
    for j in range(len(q)):
        _exp(chain.screw[j], q[j], turn)
        before = chain.before[j]
        if before < 0:
            E[j], jacobian[:, j] = turn, chain.screw[j]
        else:
            _product(E[before], turn, E[j])
            _carry(E[before], chain.screw[j], j, jacobian)
    for f in range(len(chain.carried)):
        if chain.carried[f] < 0:
            T_base_frame[f] = chain.T_base_frame[f]
        else:
            _product(E[chain.carried[f]], chain.T_base_frame[f], T_base_frame[f])


@compiled
def _exp(screw: Array, q: float, T: Array) -> None:
    """The motion by q along a screw whose angular part is a unit vector, or zero if it slides."""
    v, w = screw[:3], screw[3:]
    c, s = np.cos(q), np.sin(q)
    T[:] = 0.0
    T[3, 3] = 1.0
    if w[0] == 0.0 and w[1] == 0.0 and w[2] == 0.0:
        for i in range(3):
            T[i, i], T[i, 3] = 1.0, q * v[i]
        return
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        T[i, i] = c + (1.0 - c) * w[i] * w[i]
        T[i, j] = (1.0 - c) * w[i] * w[j] - s * w[k]
        T[i, k] = (1.0 - c) * w[i] * w[k] + s * w[j]
    # the axis goes through r = w x v, and a turn about it moves the origin to r - R r
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        T[i, 3] = w[j] * v[k] - w[k] * v[j]
    x, y, z = T[0, 3], T[1, 3], T[2, 3]
    pitch = w[0] * v[0] + w[1] * v[1] + w[2] * v[2]
    for i in range(3):
        T[i, 3] += q * pitch * w[i] - (T[i, 0] * x + T[i, 1] * y + T[i, 2] * z)


@compiled
def _product(A: Array, B: Array, out: Array) -> None:
    """Of two poses."""
    for i in range(3):
        for k in range(4):
            out[i, k] = A[i, 0] * B[0, k] + A[i, 1] * B[1, k] + A[i, 2] * B[2, k]
        out[i, 3] += A[i, 3]
        out[3, i] = 0.0
    out[3, 3] = 1.0


@compiled
def _carry(T: Array, screw: Array, j: int, jacobian: Array) -> None:
    """Write to column j a screw that was moved by T: turned, and p x w added to its linear part."""
    for i in range(3):
        jacobian[i, j] = jacobian[3 + i, j] = 0.0
        for k in range(3):
            jacobian[i, j] += T[i, k] * screw[k]
            jacobian[3 + i, j] += T[i, k] * screw[3 + k]
    x, y, z = jacobian[3, j], jacobian[4, j], jacobian[5, j]
    jacobian[0, j] += T[1, 3] * z - T[2, 3] * y
    jacobian[1, j] += T[2, 3] * x - T[0, 3] * z
    jacobian[2, j] += T[0, 3] * y - T[1, 3] * x
