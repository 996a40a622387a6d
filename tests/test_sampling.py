"""Samples of surfaces: as close together as is asked for, and one a cube."""

import numpy as np

from app.judge.sampling import surface_points

SPACING = 0.02


def triangles(seed):
    """Vertices and faces of separate triangles of all sizes."""
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(-3, -0.5, (40, 1, 1))
    corners = rng.normal(size=(40, 1, 3)) * 0.3 + size * rng.normal(size=(40, 3, 3))
    return corners.reshape(-1, 3), np.arange(120).reshape(40, 3)


def test_every_point_of_a_surface_has_a_sample_near_it():
    vertices, faces = triangles(3)
    samples = surface_points(vertices, faces, SPACING)
    share = np.random.default_rng(4).dirichlet(np.ones(3), (40, 60))
    points = (share @ vertices[faces]).reshape(-1, 3)
    away = np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)
    # the lattice is at most its spacing away, and one in the same cube stands for what is left out
    assert away.max() < SPACING * (1.0 + np.sqrt(3.0))


def test_of_the_samples_that_share_a_cube_only_the_first_stays():
    vertices, faces = triangles(5)
    samples = surface_points(vertices, faces, SPACING)
    cubes = {tuple(c) for c in np.floor(samples / SPACING).astype(int).tolist()}
    assert len(cubes) == len(samples)
    # a large triangle after the others, through the first of them, takes none of theirs away
    across = vertices[0] + 0.2 * np.eye(3) - 0.05
    more = surface_points(
        np.concatenate([vertices, across]), np.concatenate([faces, [[120, 121, 122]]]), SPACING
    )
    np.testing.assert_array_equal(more[: len(samples)], samples)
    assert len(more) > len(samples)
