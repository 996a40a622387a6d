"""How surfaces send light back: the arm's links, the world's bodies and dirty windows, seeded."""

from zlib import crc32

import numpy as np

from app.messages import Array
from app.robot.skin import Skin
from app.sensing.budget import Budget
from app.sensing.error_model import USUAL
from app.sensing.response import Surfaces
from app.sensing.truth_parts import Part, stream
from app.world.world import Body

DARKEST, LIGHTEST = 0.05, 0.9  # reflectance: dark cloth, bright paint
DIRTY = 0.1  # share of sensors with a dirty window, at strength 1
SMUDGE = (0.1, 0.6)  # [1/m^2] light of one: as of a grey target at half a metre to a metre
WINDOW = (0.004, 0.015)  # [m] from the lens


class Finish:
    """The reflectance of everything; a body keeps its own by its name."""

    def __init__(self, budget: Budget, seed: int, links: int, skin: Skin) -> None:
        """links: how many the arm has."""
        self._budget, self._seed = budget, seed
        self._links = self._drawn(stream(self._seed, Part.REFLECTANCE, 0), links)
        self._smudge, self.window = dirty_windows(budget.cover, seed, skin)
        self._bodies: tuple[Body, ...] = ()
        self._surfaces = self._of(())

    def surfaces(self, bodies: tuple[Body, ...]) -> Surfaces:
        """All surfaces, beside these bodies of the world."""
        if bodies is not self._bodies:
            self._bodies, self._surfaces = bodies, self._of(bodies)
        return self._surfaces

    def _of(self, bodies: tuple[Body, ...]) -> Surfaces:
        each = np.array([self._reflectance(b) for b in bodies])
        return Surfaces(self._links, each, self._smudge, self.window)

    def _reflectance(self, body: Body) -> float:
        if body.reflectance is not None:
            return body.reflectance
        rng = stream(self._seed, Part.REFLECTANCE, 1, crc32(body.name.encode()))
        return float(self._drawn(rng, 1)[0])

    def _drawn(self, rng: np.random.Generator, n: int) -> Array:
        """Evenly in the logarithm, drawn in towards the usual one by a strength below 1."""
        rho = DARKEST * (LIGHTEST / DARKEST) ** rng.random(n)
        return np.asarray(USUAL * (rho / USUAL) ** min(self._budget.reflectance, 1.0))


def dirty_windows(strength: float, seed: int, skin: Skin) -> tuple[Array, Array]:
    """Light of each zone's window (Z,) [1/m^2], and where each sensor has it (K,) [m]; 0: clean."""
    rng = stream(seed, Part.COVER)
    u = rng.random((skin.count, 3))
    dirty = u[:, 0] < DIRTY * strength
    light = np.where(dirty, SMUDGE[0] + (SMUDGE[1] - SMUDGE[0]) * u[:, 1], 0.0)
    window = np.where(dirty, WINDOW[0] + (WINDOW[1] - WINDOW[0]) * u[:, 2], 0.0)
    return light[skin.sensor_of] * rng.uniform(0.5, 1.5, skin.slots), window
