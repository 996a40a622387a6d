"""Every column of the calibration's Jacobian against finite differences; the solver against a
dense one."""

import numpy as np
import pytest

from app.calibration.fit import Fit, Fitter
from app.calibration.model import CURVE, LATE, LEAD, PLANES, POSE, Predicted, Rows
from app.calibration.placing import joints_first, moved_planes
from app.calibration.planes import planes_of
from app.calibration.solver import Prior, solve_step
from app.calibration.views import Path, Views
from app.robot.model import find_robot, load_robot
from app.robot.posture import rotation_matrix
from app.robot.skin_file import load_skin
from app.world.scene import find_scene, load_scene
from tests.calibrated_arm import postures, some_of

STEP = 1e-6


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    """Two sensors in a few postures, at rest and on the way, with reports that fit nothing."""
    robot = load_robot(find_robot("ur10e"))
    whole = load_skin(robot.layout, robot)
    skin = some_of(whole, robot, ("ring1-03", "ring2-09"))
    scene, rng = load_scene(find_scene("calibration")), np.random.default_rng(0)
    q = postures(robot, scene, skin, 8, 0)
    path = Path(np.linspace(0.0, 4.0, len(q)), q)
    V = 2 * len(q)
    moving = np.arange(V) % 4 >= 2
    views = Views(
        np.arange(V) % 2, np.repeat(path.stamp - 0.1, 2).clip(0.3, 3.6), moving,
        np.repeat(q, 2, axis=0), rng.uniform(0.2, 1.5, (V, 64)), np.ones((V, 64)),
    )  # fmt: skip
    return Fitter(robot, skin, planes_of(scene), views, path)


@pytest.fixture(scope="module")
def fit(fitter: Fitter) -> Fit:
    fit = fitter.begin()
    fit.shared[[LEAD, CURVE]] = 0.2, 0.7
    fit.share[:] = np.random.default_rng(1).normal(0.0, 0.015, fit.share.shape)
    return fit


def predicted(fitter: Fitter, fit: Fit, T=None, share=None, shared=None, T_plane=None) -> Predicted:
    T = fit.T_link_sensor if T is None else T
    shared = fit.shared if shared is None else shared
    return fitter._predict(
        fit.rows, fitter._place(T, shared)[1], fit.share if share is None else share, shared,
        fit.T_plane if T_plane is None else T_plane,
    )  # fmt: skip


def counted(fitter: Fitter, fit: Fit, planes_only: bool) -> np.ndarray:
    """Rows that the fit would use; those on links move with them and are looked at anew."""
    said = predicted(fitter, fit)
    good = (said.slant > 0.4) & (said.depth > 0.0) & (np.abs(said.depth - 0.2) > 1e-3)
    return good & (fit.rows.target >= 0) if planes_only else good


@pytest.mark.parametrize("axis", range(POSE))
def test_a_sensors_pose(fitter: Fitter, fit: Fit, axis: int) -> None:
    def at(step: float) -> np.ndarray:
        move = np.eye(4)
        if axis < 3:
            move[axis, 3] = step
        else:
            move[:3, :3] = rotation_matrix(step * np.eye(3)[axis - 3])
        return predicted(fitter, fit, T=fit.T_link_sensor @ move).report

    use = counted(fitter, fit, planes_only=False)
    assert use.sum() > 200
    difference = (at(STEP) - at(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(
        predicted(fitter, fit).pose[use, axis], difference[use], rtol=1e-4, atol=1e-6
    )


def test_a_zones_share(fitter: Fitter, fit: Fit) -> None:
    up, down = (predicted(fitter, fit, share=fit.share + s).report for s in (STEP, -STEP))
    difference = (up - down) / (2 * STEP)
    np.testing.assert_allclose(predicted(fitter, fit).zone, difference, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("column", [LATE, LEAD, CURVE])
def test_what_all_sensors_share(fitter: Fitter, fit: Fit, column: int) -> None:
    def at(step: float) -> np.ndarray:
        shared = fit.shared.copy()
        shared[column] += step
        return predicted(fitter, fit, shared=shared).report

    step = 1e-4 if column == LATE else STEP
    difference = (at(step) - at(-step)) / (2 * step)
    use = counted(fitter, fit, planes_only=True)
    # a turn of the sensor on its way changes the spread over its zones a little, too
    np.testing.assert_allclose(
        predicted(fitter, fit).shared[use, column], difference[use], rtol=0.03, atol=0.01
    )


def test_how_planes_lie(fitter: Fitter, fit: Fit) -> None:
    P = len(fit.T_plane)
    use = counted(fitter, fit, planes_only=True)
    straight = fit.shared.copy()
    straight[[LEAD, CURVE]] = 0.0
    said = predicted(fitter, fit, shared=straight)
    for axis in range(3):
        up, down = (
            predicted(
                fitter, fit, shared=straight,
                T_plane=moved_planes(fit.T_plane, np.tile(s * np.eye(3)[axis], (P, 1))),
            ).report
            for s in (STEP, -STEP)
        )  # fmt: skip
        column = said.shared[np.arange(len(use)), PLANES + 3 * fit.rows.target.clip(0) + axis]
        difference = (up - down) / (2 * STEP)
        np.testing.assert_allclose(column[use], difference[use], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("axis", range(6))
def test_how_a_joints_frame_is_off(fitter: Fitter, fit: Fit, joint: int, axis: int) -> None:
    column = joints_first(len(fit.T_plane)) + 6 * joint + axis

    def at(step: float) -> np.ndarray:
        shared = fit.shared.copy()
        shared[[LEAD, CURVE]] = 0.0
        shared[column] += step
        return predicted(fitter, fit, shared=shared).report

    straight = fit.shared.copy()
    straight[[LEAD, CURVE]] = 0.0
    said = predicted(fitter, fit, shared=straight).shared[:, column]
    use = counted(fitter, fit, planes_only=True)
    difference = (at(STEP) - at(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(said[use], difference[use], rtol=1e-3, atol=1e-5)


def test_the_blocks_are_the_dense_solution() -> None:
    """Poses, zones and what is shared, eliminated in turn, against all of them at once."""
    rng, K, Z, G, N = np.random.default_rng(2), 3, 4, 5, 240
    sensor, zone = np.sort(rng.integers(0, K, N)), rng.integers(0, Z, N)
    order = np.lexsort((zone, sensor))
    sensor, zone = sensor[order], zone[order]
    nothing = np.zeros(N)
    rows = Rows(sensor, zone, sensor, zone, np.zeros((N, 3)), np.zeros((N, 2)), nothing,
                np.zeros((N, 3)), nothing, nothing, rng.normal(size=N), nothing)  # fmt: skip
    J_pose, J_zone, J_shared = rng.normal(size=(N, 6)), rng.normal(size=N), rng.normal(size=(N, G))
    said = Predicted(rng.normal(size=N), nothing, nothing, nothing, J_pose, J_zone, J_shared)
    weight = rng.uniform(0.5, 2.0, N)
    pose, share, shared = rng.normal(size=(K, 6)), rng.normal(size=(K, Z)), rng.normal(size=G)
    prior = Prior(np.full(6, 2.0), 3.0, np.full(G, 1.5), np.ones(G))
    step = solve_step(rows, said, weight, pose, share, shared, prior)

    J = np.zeros((N, K * (6 + Z) + G))
    for n in range(N):
        J[n, 6 * sensor[n] : 6 * sensor[n] + 6] = J_pose[n]
        J[n, 6 * K + Z * sensor[n] + zone[n]] = J_zone[n]
        J[n, -G:] = J_shared[n]
    sigma = np.concatenate((np.full(6 * K, 2.0), np.full(Z * K, 3.0), np.full(G, 1.5)))
    middle = np.concatenate((-pose.ravel(), -share.ravel(), 1.0 - shared))
    cov = np.linalg.inv(J.T @ (J * weight[:, None]) + np.diag(sigma**-2))
    x = cov @ (J.T @ (weight * (rows.report - said.report)) + middle * sigma**-2)
    np.testing.assert_allclose(step.pose.ravel(), x[: 6 * K], atol=1e-10)
    np.testing.assert_allclose(step.share.ravel(), x[6 * K : -G], atol=1e-10)
    np.testing.assert_allclose(step.shared, x[-G:], atol=1e-10)
    for k in range(K):
        mine = slice(6 * k, 6 * k + 6)
        np.testing.assert_allclose(step.pose_cov[k], cov[mine, mine], atol=1e-10)
    np.testing.assert_allclose(
        step.share_sigma.ravel(), np.sqrt(np.diagonal(cov)[6 * K : -G]), atol=1e-10
    )
