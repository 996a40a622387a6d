"""One step of the least squares: sensors are blocks, and what they share couples them.

Unknowns are the sensors' poses p (6 each), their zones' shares z, and what all share, g. A row
reads one zone of one sensor, so the normal matrix of a sensor is

    | A_pp  A_pz  A_pg |                          D = diag over zones
    |  .    D     A_zg |
    |  .     .    A_gg |

Zones are eliminated first (Schur complement by D), then the pose of each sensor; what is left is
as large as g. Covariances come back the same way.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.calibration.model import POSE, Predicted, Rows
from app.messages import Array


@dataclass(frozen=True, eq=False, slots=True)
class Prior:
    """What is believed before: standard deviations. pose: (6,).   share: of a zone.   shared: (G,)
    and its `middle` (G,)."""

    pose: Array
    share: float
    shared: Array
    middle: Array


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """What to add, and how well it is known: pose (K, 6), share (K, Z), shared (G,); pose_cov
    (K, 6, 6), share_sigma (K, Z), shared_cov (G, G)."""

    pose: Array
    share: Array
    shared: Array
    pose_cov: Array
    share_sigma: Array
    shared_cov: Array


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """One sensor with its zones eliminated: S (6 + G, 6 + G), b (6 + G,); and the way back: D
    (Z,), E (Z, 6 + G), c (Z,)."""

    S: Array
    b: Array
    D: Array
    E: Array
    c: Array


def solve_step(
    rows: Rows, said: Predicted, weight: Array, pose: Array, share: Array, shared: Array,
    prior: Prior,
) -> Step:  # fmt: skip
    """weight: (N,) of the rows.   pose: (K, 6) so far, from where it was laid out; share: (K, Z)
    and shared (G,) likewise."""
    K = len(pose)
    told = np.flatnonzero(said.shared.any(axis=0))  # of the rest nothing but the prior is known
    rest = rows.report - said.report
    first = np.searchsorted(rows.sensor, np.arange(K + 1))
    blocks = []
    total = np.diag(prior.shared[told] ** -2)
    right = ((prior.middle - shared) * prior.shared**-2)[told]
    for k in range(K):
        mine = slice(first[k], first[k + 1])
        J = np.concatenate((said.pose[mine], said.shared[mine][:, told]), axis=1)
        block = reduced(
            J, said.zone[mine], rows.zone[mine], rest[mine], weight[mine], share[k], prior.share
        )
        block.S[np.arange(POSE), np.arange(POSE)] += prior.pose**-2
        block.b[:POSE] -= pose[k] * prior.pose**-2
        blocks.append(block)
        way = np.linalg.solve(block.S[:POSE, :POSE], block.S[:POSE])  # (6, 6 + G)
        total += block.S[POSE:, POSE:] - block.S[POSE:, :POSE] @ way[:, POSE:]
        right += block.b[POSE:] - way[:, POSE:].T @ block.b[:POSE]
    cov_told: Array = np.asarray(np.linalg.inv(total), dtype=np.float64)
    dg_told = cov_told @ right
    parts = [_back(block, dg_told, cov_told) for block in blocks]
    dp, dz, cov, sigma = (np.array(column) for column in zip(*parts, strict=True))
    dg, shared_cov = prior.middle - shared, np.diag(prior.shared**2)
    dg[told] = dg_told
    shared_cov[np.ix_(told, told)] = cov_told
    return Step(dp, dz, dg, cov, sigma, shared_cov)


def reduced(
    J: Array, J_zone: Array, zone: NDArray[np.intp], rest: Array, weight: Array, share: Array,
    sigma: float,
) -> Block:  # fmt: skip
    """The normal equations of one sensor's rows (N,), sorted by zone, without its zones.

    J: (N, m) of all but the zones.   J_zone: (N,).   share: (Z,) so far; sigma: its prior.
    """
    Z = len(share)
    WJ = J * weight[:, None]
    A, b = J.T @ WJ, WJ.T @ rest
    D: Array = sigma**-2 + np.bincount(zone, weight * J_zone**2, Z).astype(np.float64)
    c = np.bincount(zone, weight * J_zone * rest, Z) - share * sigma**-2
    E = np.zeros((Z, J.shape[1]))
    if len(zone):
        begins = np.flatnonzero(np.diff(zone, prepend=-1))
        E[zone[begins]] = np.add.reduceat(WJ * J_zone[:, None], begins, axis=0)
    DE = E / D[:, None]
    return Block(A - E.T @ DE, b - DE.T @ c, D, E, c)


def _back(block: Block, dg: Array, shared_cov: Array) -> tuple[Array, Array, Array, Array]:
    """A sensor's step and covariance from those of what all share."""
    P = np.linalg.inv(block.S[:POSE, :POSE])
    F = P @ block.S[:POSE, POSE:]
    dp = P @ block.b[:POSE] - F @ dg
    cov = P + F @ shared_cov @ F.T
    both = np.block([[cov, -F @ shared_cov], [-shared_cov @ F.T, shared_cov]])
    DE = block.E / block.D[:, None]
    dz = block.c / block.D - DE @ np.concatenate((dp, dg))
    sigma = np.sqrt(1.0 / block.D + np.einsum("zi,ij,zj->z", DE, both, DE))
    return dp, dz, cov, sigma
