"""What the arm of the perception benches stands among."""

import numpy as np

from app.world.world import World

COUNT, RADIUS, AROUND = 14, 0.12, 1.0  # [m]


def world_of_spheres(rng: np.random.Generator) -> World:
    """Spheres at random places in a cube around the base, none moving."""
    world = World(())
    for _ in range(COUNT):
        place = rng.uniform(-AROUND, AROUND, 3)
        world.add("", {"kind": "sphere", "radius_m": RADIUS}, tuple(place))
    return world
