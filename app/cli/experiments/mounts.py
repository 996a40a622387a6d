"""`flinch experiment mounts`: does a calibration find where the sensors really sit?"""

import sys
from dataclasses import dataclass

from app.cli.seed import Seed
from app.cli.which import WhichRobot
from app.errors import ConfigError


@dataclass(frozen=True)
class Mounts(WhichRobot):
    """Calibrate simulated arms whose sensors were glued on by hand, and compare with the truth."""

    seeds: int = 20
    """Number of arms."""
    seed: Seed = 0
    """Seed of the first."""
    seconds: float = 300.0
    """Of motion, at most [s]."""
    speed: float = 0.6
    """Of the fastest joint [rad/s]."""
    scene: str = "calibration"
    """What there is to be looked at: a scene's name, or the path of its TOML file."""
    world: str = "honest,late_ms=40"
    """How far the simulated world is from what is believed; see `flinch run --world`."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise ConfigError(f"seeds = {self.seeds}; give 1 or more")

    def __call__(self) -> None:
        from app.calibration.session import Pace
        from app.studies.mount_errors import mount_errors

        setup = self.setup(seed=self.seed, scene=self.scene, world=self.world)
        pace = Pace(self.seconds, self.speed)
        report = mount_errors(
            setup, self.seeds, pace, lambda words: print(words, file=sys.stderr, flush=True)
        )
        print(report.to_json() if self.json else report.to_text())
