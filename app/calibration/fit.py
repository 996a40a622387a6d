"""The fit: Gauss-Newton steps with weights that lose what does not belong.

Where a zone looks is asked anew while the poses still move. Weights are those of Geman and McClure,

    w = 1 / (sigma^2 (1 + (r / (c sigma))^2)^2)

so that what is far off pulls the less the farther it is. The width c shrinks from step to step: at
first a sensor that is 0.5 degrees off is off by several sigma in every zone.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.calibration.model import (
    CURVE,
    LATE,
    LEAD,
    PLANES,
    POSE,
    STEEPEST,
    Placed,
    Predicted,
    Rows,
    drawn_near,
    predict,
)
from app.calibration.placing import (
    Stance,
    Zones,
    joints_first,
    moved_planes,
    placed_of,
    rows_of,
    stance_of,
)
from app.calibration.planes import Plane
from app.calibration.sight import FIRST_LINK, Surroundings
from app.calibration.solver import Prior, Step, solve_step
from app.calibration.views import Path, Views
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import rotation_matrix, rotation_vector
from app.robot.skin import Skin

WIDTHS = (12.0, 6.0, 4.0, 3.0, 3.0, 3.0)  # c of each step
SETTLED = 3.0  # c from which residuals tell how large sigma is
ENOUGH, SCALES = 300, (0.4, 3.0)  # rows of a kind for that, and what is believed of it
ONE_SIGMA = 1.4826  # of the median of |r| of a normal distribution
LOOKS = (1, 3)  # steps before which it is asked where zones look
LATE_PRIOR = 0.03, 0.06  # [s] one sigma, of stamps of a stream without a clock
# of a mean over the zone weighted with the light that comes back, cos / r^2: the mean depth of a
# plane is d (1 + rho^2), the weight falls with d^3, which takes off 3 rho^2; evenly it would be -1
LEAD_PRIOR, CURVE_PRIOR = (0.0, 0.5), (2.0, 0.15)
JOINT_PRIOR = (5e-4,) * 3 + (float(np.radians(0.05)),) * 3  # a UR's calibration against nominal
ASKED = 2  # step after which it is asked which windows are dirty
CLEAN, DIRTY = 1e-4, 0.3  # one sigma of the glare of a clean and of a dirty window
SURE, LEAST_GLARE = 4.0, 0.02  # sigmas from which glare is believed, and what matters
UNEVEN = 0.4  # of the glare of a sensor, from zone to zone
ROUNDED = 0.3e-3  # [m] of reports in whole millimetres
SLANTED = 0.2  # of a zone's spread: how uncertain it is which part of it is reported
WIDEST = 0.015  # [m] spread of a zone that still counts
# [m] a link against its mesh, with hoses and all: a millimetre or two, but alike in all returns
# from one place, of which there are a hundred
NOT_FLAT = 0.02
NEAR_SHARE = 0.5  # of the offset near the lens that its type gives
ON_THE_WAY = 0.001  # [m] of a moving arm's reports: between two of its joint states


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """What was found: T_link_sensor (K, 4, 4), glare (K,), share (K, Z), shared (G,), T_plane
    (P, 4, 4), the last step's covariances, and the rows with their residuals [m], sigma [m] and
    weight.   dirty: (K,) sensors whose windows send light back."""

    T_link_sensor: Array
    glare: Array
    share: Array
    shared: Array
    T_plane: Array
    step: Step
    rows: Rows
    residual: Array
    sigma: Array
    weight: Array
    dirty: NDArray[np.bool_]

    @property
    def late(self) -> float:
        """[s] that stamps are late."""
        return float(self.shared[LATE])

    @property
    def late_sigma(self) -> float:
        """[s] one standard deviation of it."""
        return float(np.sqrt(self.step.shared_cov[LATE, LATE]))


class Fitter:
    """The fit of one recording's views."""

    def __init__(
        self, robot: Robot, skin: Skin, planes: tuple[Plane, ...], views: Views, path: Path
    ) -> None:
        self.robot, self.skin, self.planes, self.views, self.path = (
            robot, skin, planes, views, path
        )  # fmt: skip
        self.around = Surroundings(robot, skin, planes)
        self.zones = Zones(skin, self.around.zones)
        self.laid_out = np.array([s.T_link_sensor for s in skin.sensors])
        errors = [s.type.error for s in skin.sensors]
        known = skin.ranges is not None  # then the offset near the lens is in the table
        self._near = np.array(
            [[0.0 if known else e.near_offset_m, e.near_offset_below_m] for e in errors]
        )
        self.prior = self._prior()

    def begin(self) -> Fit:
        """As laid out, with residuals."""
        K, G = self.skin.count, len(self.prior.middle)
        nothing = Step(
            np.zeros((K, POSE + 1)), np.zeros((K, self.around.zones)), np.zeros(G),
            np.array([np.diag(p**2) for p in self.prior.pose]),
            np.full((K, self.around.zones), self.prior.share), np.diag(self.prior.shared**2),
        )  # fmt: skip
        T_plane = np.array([p.T_base_plane for p in self.planes])
        share = np.zeros((K, self.around.zones))
        return self._look(self.laid_out, share, self.prior.middle.copy(), T_plane, nothing)

    def expected(self) -> tuple[Fit, Predicted]:
        """As laid out, with what the views should report: for views that nobody has seen yet."""
        fit = self.begin()
        _, placed = self._place(fit.T_link_sensor, fit.shared)
        return fit, self._predict(fit.rows, placed, fit.share, fit.shared, fit.T_plane, fit.glare)

    def run(self, fit: Fit | None = None) -> Fit:
        """All steps."""
        fit = fit or self.begin()
        for i, width in enumerate(WIDTHS):
            fit = self._step(fit, width, look=i in LOOKS)
            if i == ASKED:
                fit = replace(fit, dirty=self._dirty(fit))
        return fit

    def _dirty(self, fit: Fit) -> NDArray[np.bool_]:
        """(K,) windows of which one step that allows all of them glare finds it for sure."""
        everyone = np.ones(self.skin.count, dtype=np.bool_)
        step = self._step(replace(fit, dirty=everyone), WIDTHS[ASKED], look=False)
        sigma = np.sqrt(step.step.pose_cov[:, POSE, POSE])
        return np.asarray((step.glare > SURE * sigma) & (step.glare > LEAST_GLARE))

    def _step(self, fit: Fit, width: float, look: bool) -> Fit:
        rows = fit.rows
        stance, placed = self._place(fit.T_link_sensor, fit.shared)
        if look:
            rows = self._rows(stance, placed, fit.T_plane)
        said = self._predict(rows, placed, fit.share, fit.shared, fit.T_plane, fit.glare)
        useful, rest = _useful(said), rows.report - said.report
        sigma = self._sigma(rows, said, fit.glare)
        if width <= SETTLED:
            sigma = sigma * self._scale(rows, rest / sigma, useful)
        weight = np.where(useful, _weights(rest / sigma, width) / sigma**2, 0.0)
        step = solve_step(
            rows, said, weight, np.column_stack((self.offsets(fit.T_link_sensor), fit.glare)),
            fit.share, fit.shared, self._prior_of(fit.dirty),
        )  # fmt: skip
        T = fit.T_link_sensor @ np.array([_rigid(p) for p in step.pose])
        share, shared = fit.share + step.share, fit.shared + step.shared
        glare = fit.glare + step.pose[:, POSE]
        P = len(self.planes)
        T_plane = moved_planes(fit.T_plane, step.shared[PLANES : PLANES + 3 * P].reshape(P, 3))
        said = self._predict(rows, self._place(T, shared)[1], share, shared, T_plane, glare)
        rest = rows.report - said.report
        return Fit(T, glare, share, shared, T_plane, step, rows, rest, sigma, weight, fit.dirty)

    def offsets(self, T_link_sensor: Array) -> Array:
        """(K, 6) shift [m] and turn [rad] of each sensor in its frame as laid out."""
        T = np.linalg.inv(self.laid_out) @ T_link_sensor
        return np.array([[*t[:3, 3], *rotation_vector(t[:3, :3])] for t in T])

    def _look(self, T: Array, share: Array, shared: Array, T_plane: Array, step: Step) -> Fit:
        stance, placed = self._place(T, shared)
        rows = self._rows(stance, placed, T_plane)
        clean = np.zeros(self.skin.count)
        said = self._predict(rows, placed, share, shared, T_plane, clean)
        sigma = self._sigma(rows, said, clean)
        weight = np.where(_useful(said), sigma**-2, 0.0)
        rest, dirty = rows.report - said.report, np.zeros(self.skin.count, dtype=np.bool_)
        return Fit(T, clean, share, shared, T_plane, step, rows, rest, sigma, weight, dirty)

    def _place(self, T_link_sensor: Array, shared: Array) -> tuple[Stance, Placed]:
        error = shared[joints_first(len(self.planes)) :].reshape(self.robot.n, 6)
        stance = stance_of(self.robot, self.views, self.path, float(shared[LATE]), error)
        return stance, placed_of(self.robot, self.skin, self.views, stance, T_link_sensor)

    def _rows(self, stance: Stance, placed: Placed, T_plane: Array) -> Rows:
        return rows_of(self.views, stance, placed, self.around, self.zones, T_plane)

    def _predict(
        self, rows: Rows, placed: Placed, share: Array, shared: Array, T_plane: Array, glare: Array
    ) -> Predicted:
        n = T_plane[:, :3, 2]
        height = rows.height.copy()
        normal = rows.normal.copy()
        on = rows.target >= 0
        normal[on] = n[rows.target[on]]
        height[on] = (n * T_plane[:, :3, 3]).sum(axis=1)[rows.target[on]]
        now = Rows(**{
            name: {"normal": normal, "height": height}.get(name, getattr(rows, name))
            for name in Rows.__slots__
        })  # fmt: skip
        k = rows.sensor
        return predict(now, placed, share[k, rows.zone], shared, T_plane, self._near[k], glare[k])

    def _sigma(self, rows: Rows, said: Predicted, glare: Array) -> Array:
        """(N,) [m] one standard deviation of each row, with what the model leaves out."""
        floor, part = self.skin.traits.noise[rows.sensor].T
        noise = np.maximum(floor, part * np.abs(rows.report)) / np.sqrt(rows.frames)
        near = self._near[rows.sensor]
        offset = NEAR_SHARE * near[:, 0] * np.clip(1.0 - said.depth / near[:, 1], 0.0, 1.0)
        moving = np.where(self.views.moving[rows.view], ON_THE_WAY, 0.0)
        flat = np.where(rows.target <= FIRST_LINK, NOT_FLAT, 0.0)
        slant = SLANTED * said.spread
        drawn = UNEVEN * glare[rows.sensor] * drawn_near(said.depth)[0]
        parts = noise, offset, moving, flat, slant, drawn
        return np.asarray(np.sqrt(ROUNDED**2 + sum(p**2 for p in parts)))

    def _prior_of(self, dirty: NDArray[np.bool_]) -> Prior:
        """The prior with these windows (K,) dirty."""
        pose = self.prior.pose.copy()
        pose[dirty, POSE] = DIRTY
        return replace(self.prior, pose=pose)

    def _scale(self, rows: Rows, z: Array, useful: NDArray[np.bool_]) -> Array:
        """(N,) by what the spread of residuals differs from sigma, kind by kind."""
        kind = 2 * (rows.target <= FIRST_LINK) + self.views.moving[rows.view]
        out = np.ones(len(z))
        for i in range(2):  # links are as uncertain as they are, however well they seem to fit
            mine = (kind == i) & useful
            if mine.sum() >= ENOUGH:
                out[kind == i] = np.clip(ONE_SIGMA * np.median(np.abs(z[mine])), *SCALES)
        return out

    def _prior(self) -> Prior:
        doubt = self.skin.doubt
        planes = [s for p in self.planes for s in (p.sigma[0], p.sigma[1], p.sigma[1])]
        joints = list(JOINT_PRIOR) * self.robot.n
        shared = [LATE_PRIOR[1], LEAD_PRIOR[1], CURVE_PRIOR[1], *planes, *joints]
        middle = np.zeros(len(shared))
        middle[[LATE, LEAD, CURVE]] = LATE_PRIOR[0], LEAD_PRIOR[0], CURVE_PRIOR[0]
        position, angle = float(doubt.position.max()), float(doubt.angle.max())
        pose = np.array([position] * 3 + [angle] * 3 + [CLEAN])
        return Prior(
            np.tile(pose, (self.skin.count, 1)), float(doubt.share.max()), np.array(shared),
            middle,
        )  # fmt: skip


def _useful(said: Predicted) -> NDArray[np.bool_]:
    """(N,) rows that the model can speak of."""
    return (said.slant > STEEPEST) & (said.spread < WIDEST) & (said.depth > 0.0)


def _weights(r: Array, width: float) -> Array:
    return np.asarray(1.0 / (1.0 + (r / width) ** 2) ** 2)


def _rigid(step: Array) -> Array:
    T = np.eye(4)
    T[:3, 3], T[:3, :3] = step[:3], rotation_matrix(step[3:6])
    return T
