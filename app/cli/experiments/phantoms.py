"""`flinch experiment phantoms`: is an arm held by phantoms of itself?"""

from dataclasses import dataclass

from app.cli.seed import Seed
from app.errors import ConfigError


@dataclass(frozen=True)
class Phantoms:
    """Move an arm that has nothing near it, and count the ticks in which a point of itself holds
    it: as laid out and calibrated, with late stamps, other zones, a tool."""

    seeds: int = 4
    """Number of arms, each with its own errors."""
    seconds: float = 10.0
    """Length of each run [s]."""
    only: tuple[str, ...] = ()
    """Names of the conditions to run; all where left out."""
    world: str = "honest"
    """Error budget of the simulation: 'honest', or with single parts, 'honest,cover=0'."""
    seed: Seed = 0
    """Seed of the first arm."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.seeds < 1 or not 0.0 < self.seconds < 1e6:
            raise ConfigError("seeds and seconds must be positive")

    def __call__(self) -> None:
        from app.studies.phantoms import choose, phantoms

        report = phantoms(self.seeds, self.seconds, self.seed, choose(self.only), self.world)
        print(report.to_json() if self.json else report.to_text())
