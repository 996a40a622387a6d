"""From a recording to an overlay: places, fit, and who remains unsure."""

from dataclasses import dataclass

import numpy as np

from app.calibration.fit import Fit, Fitter
from app.calibration.places import Place, find_places, skin_in_places
from app.calibration.planes import Plane
from app.calibration.recording import Recording
from app.calibration.views import path_of, views_of
from app.messages import Array
from app.robot.model import Robot
from app.robot.mounts import MountsTable, MountTable
from app.robot.skin import Skin

# one sigma of a component; beyond either a sensor is hardly better known than it was laid out, and
# unsure
SURE_MM, SURE_DEG = 1.8, 0.21
NEAR = 0.45  # [m] looks that tell a shift from a share
FEWEST = 300  # rows of a sensor
CLOSER = "stand a board or a wall before it, 0.15 to 0.4 m away, and turn it about there"
FARTHER = "show it a wall from 0.5 to 1 m as well, and from several sides"
# of variance: looks at one face err alike by what the model leaves out (a link's true shape, how a
# pulse curves), which a fit of independent rows cannot know; errors of simulated arms in the honest
# world (seeds 0 to 2) had a mean square of 2.2 to 4.7 times what their fits said
LEFT_OUT = 3.2
FITS = 0.5  # share of a sensor's rows that must count


@dataclass(frozen=True, eq=False, slots=True)
class Estimate:
    """What a calibration found. skin: with every sensor in its place, as laid out there.

    before, after: the fits at the beginning and at the end.   mounts: the overlay.
    """

    skin: Skin
    places: tuple[Place, ...]
    before: Fit
    after: Fit
    mounts: MountsTable


def estimate_mounts(
    robot: Robot, skin: Skin, planes: tuple[Plane, ...], recording: Recording
) -> Estimate:
    """skin: as laid out.   planes: what was there to be seen."""
    views, path = views_of(recording, skin), path_of(recording)
    places = find_places(robot, skin, planes, views, path)
    there = skin_in_places(robot, skin, places)
    fitter = Fitter(robot, there, planes, views, path)
    before = fitter.begin()
    after = fitter.run(before)
    return Estimate(there, places, before, after, _mounts(robot, skin, fitter, places, after))


def _mounts(
    robot: Robot, skin: Skin, fitter: Fitter, places: tuple[Place, ...], fit: Fit
) -> MountsTable:
    offsets = fitter.offsets(fit.T_link_sensor)
    sensors = [_mount(skin, k, places[k], offsets[k], fit) for k in range(skin.count)]
    return MountsTable(
        robot=robot.name, layout=skin.title, late_ms=round(1e3 * fit.late, 3),
        late_sigma_ms=round(1e3 * fit.late_sigma, 3), sensor=tuple(sensors),
    )  # fmt: skip


def _mount(skin: Skin, k: int, place: Place, offset: Array, fit: Fit) -> MountTable:
    sensor, laid_out = skin.sensors[k], skin.sensors[place.place]
    sigma_mm, sigma_deg = sigmas(fit, k)
    zones = sensor.type.zones
    share, sigma = fit.share[k, :zones], fit.step.share_sigma[k, :zones]
    x, y, z = (1e3 * offset[:3]).round(4).tolist()
    u, v, w = np.degrees(offset[3:]).round(5).tolist()
    turned = (place.rotation_deg, place.mirrored) != (laid_out.rotation_deg, laid_out.mirrored)
    return MountTable(
        name=sensor.name,
        place=laid_out.name if place.place != k else "",
        rotation_deg=place.rotation_deg if turned else None,
        mirrored=place.mirrored if turned else None,
        shift_mm=(x, y, z),
        turn_deg=(u, v, w),
        sigma_mm=round(sigma_mm, 4),
        sigma_deg=round(sigma_deg, 5),
        # reports are d (1 + b); what is to be added is a share of the report
        zone_percent=tuple((100 * (1.0 / (1.0 + share) - 1.0)).round(4).tolist()),
        zone_sigma_percent=round(100 * float(np.sqrt((sigma**2).mean())), 4),
        unsure=unsure(fit, k),
    )


def stated_cov(fit: Fit) -> Array:
    """(K, 6, 6) [m, rad] of each sensor's pose, its frame: the fit's own, widened by `LEFT_OUT`."""
    return np.asarray(LEFT_OUT * fit.step.pose_cov[:, :6, :6])


def sigmas(fit: Fit, k: int) -> tuple[float, float]:
    """[mm] and [deg], one standard deviation of a component."""
    variance = np.diagonal(stated_cov(fit)[k])
    position, angle = np.sqrt(variance[:3].mean()), np.sqrt(variance[3:6].mean())
    return 1e3 * float(position), float(np.degrees(angle))


def unsure(fit: Fit, k: int) -> str:
    """Why a sensor is not known well, and what would help; empty where it is."""
    mine = fit.rows.sensor == k
    used = mine & (fit.weight > 0.0)
    near = int((used & (fit.rows.report < NEAR)).sum())
    mm, deg = sigmas(fit, k)
    better = CLOSER if near < used.sum() / 2 else FARTHER
    if not used.any():
        return f"it saw nothing that is known here; {better}"
    fits = float((fit.weight * fit.sigma**2)[used].mean())
    if fits < FITS:
        return (
            f"only {100 * fits:.0f} % of what it saw fits any pose; look whether it moves in its "
            "cover, or whether something stood in its way, and repeat"
        )
    if fit.dirty[k]:
        return "its window is dirty and draws near things nearer; wipe it, and repeat"
    if mm <= SURE_MM and deg <= SURE_DEG and used.sum() >= FEWEST:
        return ""
    return (
        f"known to {mm:.1f} mm and {deg:.2f} deg only: it saw {int(used.sum())} returns, {near} of "
        f"them nearer than {NEAR:g} m; {better}"
    )
