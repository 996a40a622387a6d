"""`flinch bench`: measure this machine."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from app.cli.seed import Seed
from app.cli.which import WhichRobot


@dataclass(frozen=True)
class Bench(WhichRobot):
    """Measure: `tick` each room of a tick and its lateness, `perception`, or its `peers`;
    `control` the step from pairs to velocity, beside other software where it is installed;
    `serial` a whole skin over a virtual port: losses, latency, the reader's load; `deadlines`
    missed by sensors and rate with a page being looked at (the rate is then its own); `guard`
    the steps of `flinch.Guard`, on what an arm in the scene has met."""

    what: tyro.conf.Positional[
        Literal["tick", "perception", "peers", "control", "serial", "deadlines", "guard"]
    ]
    scene: str = "cell"
    """A scene's name, or the path of its TOML file."""
    rate: float = 250.0
    """Ticks a second, 50 to 500."""
    seconds: float = 5.0
    """Length of each measurement [s]."""
    seed: Seed = 0
    """Seed of the sensors' noise and of the people's habits."""
    heavy_urdf: Path | None = None
    """Perception and peers: a UR10e description whose visual meshes are tried as bodies, too."""
    plot: Path | None = None
    """Perception: draw how the times grow into this file (.svg, .png)."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        if self.what == "control":
            from app.bench.control import bench_control

            report = bench_control(steps=int(400 * self.seconds), seed=self.seed)
        elif self.what == "tick":
            from app.bench.tick import bench_tick

            setup = self.setup(scene=self.scene, rate=self.rate, seed=self.seed)
            report = bench_tick(setup, self.seconds)
        elif self.what == "guard":
            from app.bench.guard import bench_guard

            setup = self.setup(scene=self.scene, rate=self.rate, seed=self.seed)
            report = bench_guard(setup, self.seconds)
        elif self.what == "serial":
            from app.bench.serial import bench_serial

            setup = self.setup(rate=self.rate, seed=self.seed)
            report = bench_serial(setup, self.seconds)
        elif self.what == "deadlines":
            from app.bench.deadlines import bench_deadlines
            from app.ui.onlooker import onlooked

            report = bench_deadlines(onlooked, self.seconds, self.seed)
        elif self.what == "perception":
            from app.bench.perception import bench_perception

            report = bench_perception(self.seed, urdf=self.heavy_urdf, plot=self.plot)
        else:
            from app.bench.beside_peers import bench_peers

            report = bench_peers(self.seed, urdf=self.heavy_urdf)
        print(report.to_json() if self.json else report.to_text())
