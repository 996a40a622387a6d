"""Convex hulls bound true distances from below, also those of meshes that are flat."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from app.judge.truth import ROUNDING, surface

CAPSULE = coal.Capsule(0.05, 0.3)
HERE = coal.Transform3s(np.eye(3), np.zeros(3))


def distance(a, b, at):
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    return coal.distance(a, HERE, b, at, request, coal.DistanceResult())


@pytest.mark.parametrize("thickness", [0.0, 1e-9, 0.3])
def test_a_hull_is_never_farther_than_its_mesh(thickness):
    rng = np.random.default_rng(7)
    hull = surface(rng.normal(size=(30, 3)) * [1, 1, thickness], np.arange(30).reshape(10, 3))
    near = []
    for _ in range(100):
        at = coal.Transform3s(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        exact = distance(hull.exact, CAPSULE, at)
        near.append(exact < 0.1)
        assert distance(hull.hull, CAPSULE, at) < max(exact, 0.0) + ROUNDING
    assert 10 < sum(near) < 100
