"""The rays that stand for the zones of simulated sensors, in the frames of their links.

A real zone is integrated with `sub` x `sub` rays, one somewhere in each of as many equal parts,
weighted with the solid angle of the part; in an ideal world it has the rays of the self filter.
"""

import numpy as np

from app.messages import Array
from app.robot.skin import Sensor, Skin, zone_directions, zone_rays
from app.sensing.budget import Budget
from app.sensing.truth_parts import Part, stream
from app.sensing.zones import Fan

GRAZING = 1e-6  # [rad] that rounding may bend a ray out of its zone's cone


def fan_of(skin: Skin, budget: Budget, seed: int) -> Fan:
    """All rays of a skin; where in its part each of them lies is drawn with `seed`."""
    rays, weight = [], []
    for k, sensor in enumerate(skin.sensors):
        if budget.zones:
            d, w = _spread_rays(sensor, budget.sub, stream(seed, Part.ZONES, k))
        else:
            d = zone_rays(sensor)
            w = np.full(d.shape[:2], 1.0 / d.shape[1])
        d = d @ sensor.T_link_sensor[:3, :3].T
        rays.append(d / np.linalg.norm(d, axis=2, keepdims=True))  # (zones, rays, 3)
        weight.append(w)
    kinds = [s.type for s in skin.sensors]
    axis = np.concatenate([r.mean(axis=1) for r in rays])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    per_zone = np.repeat([r.shape[1] for r in rays], [t.zones for t in kinds])
    ray = np.append(0, np.cumsum(per_zone)).astype(np.int64)
    direction = np.concatenate([r.reshape(-1, 3) for r in rays])
    inside = np.einsum("ni,ni->n", direction, np.repeat(axis, per_zone, axis=0)).clip(max=1.0)
    cosine = [r.reshape(-1, 3) @ a for r, a in zip(rays, skin.axis, strict=True)]
    return Fan(
        link=np.array(skin.link, dtype=np.int64),
        lens=np.array(skin.origin),
        zone=np.array(skin.first),
        axis=axis,
        half_angle=np.arccos(np.minimum.reduceat(inside, ray[:-1])) + GRAZING,
        ray=ray,
        direction=direction,
        weight=np.concatenate([w.ravel() for w in weight]),
        report=np.concatenate(
            [np.ones_like(c) if t.radial else c for c, t in zip(cosine, kinds, strict=True)]
        ),
        separate=np.array([t.separate_m for t in kinds]),
        pulse=skin.traits.pulse,
    )


def _spread_rays(sensor: Sensor, sub: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Directions (zones, sub^2, 3) with unit depth, sensor frame, and their weights, which add up
    to 1 in each zone.

    Zones are equal in angle; of u = [tan a, tan b, 1] the solid angle is
    da db / (cos^2 a cos^2 b |u|^3).
    """
    kind = sensor.type
    row, column = np.divmod(np.arange(kind.zones, dtype=np.float64), kind.columns)
    down, across = np.divmod(np.arange(sub * sub, dtype=np.float64), sub)
    at = rng.random((2, kind.zones, sub * sub))
    rows = row[:, None] - 0.5 + (down + at[0]) / sub
    columns = column[:, None] - 0.5 + (across + at[1]) / sub
    u = zone_directions(sensor, rows.ravel(), columns.ravel())
    square = 1.0 + u[:, :2] ** 2  # 1 / cos^2
    w = (square[:, 0] * square[:, 1] / np.linalg.norm(u, axis=1) ** 3).reshape(rows.shape)
    return u.reshape(*rows.shape, 3), w / w.sum(axis=1, keepdims=True)
