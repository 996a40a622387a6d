"""The paper's claim before its panels: the whole body stays farther away than sensor mounts do.

The same seed gives WB and SM the same sensors, so what is compared is their difference seed by
seed: steady true distance of the whole arm, mean over the last `STEADY` seconds of a run.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from app.config import Params
from app.report import Check, Report
from app.setup import Setup
from app.studies.bootstrap import bootstrap
from app.studies.headless import run
from app.studies.pool import each

SCENES = ("front-panel", "side-panel")
WHOLE, MOUNTS = "wb", "sm"
STEADY = 2.0  # [s]
FARTHER = 0.10  # [m] that the whole body stays farther away


class PanelSpec(NamedTuple):
    """One run before a panel."""

    scene: str
    mode: str
    seed: int


def panels(
    seeds: int = 10, seconds: float = 8.0, seed: int = 0, *,
    jobs: int = 1, world: str = "honest", rate: float = 125.0,
) -> Report:  # fmt: skip
    """Both controllers before both panels, `seeds` runs each."""
    specs = [
        PanelSpec(scene, mode, seed + i)
        for i in range(seeds) for scene in SCENES for mode in (WHOLE, MOUNTS)
    ]  # fmt: skip
    found = list(each(partial(run_panel, seconds=seconds, world=world, rate=rate), specs, jobs))
    rows, checks = [], []
    for scene in SCENES:
        more, check = compared(scene, [r for r in found if r["scene"] == scene])
        rows += more
        checks.append(check)
    return Report("panels", seed, rows, checks)


def run_panel(spec: PanelSpec, seconds: float, world: str, rate: float) -> dict[str, Any]:
    """One run, as a row."""
    setup = Setup(scene=spec.scene, seed=spec.seed, rate=rate, world=world)
    record, _ = run(setup, seconds, Params(mode=spec.mode))
    return {
        "scene": spec.scene,
        "mode": spec.mode,
        "seed": spec.seed,
        "steady_m": record.steady(STEADY),
        "least_m": min(record.true_distance),
    }


def compared(scene: str, found: Sequence[dict[str, Any]]) -> tuple[list[dict[str, Any]], Check]:
    """Rows of one scene: each controller, and their difference with its interval."""
    steady = {(r["mode"], r["seed"]): r["steady_m"] for r in found}
    seeds = sorted({r["seed"] for r in found})
    rows: list[dict[str, Any]] = []
    for mode in (WHOLE, MOUNTS):
        mean, low, high = bootstrap([steady[mode, s] for s in seeds])
        least = min(r["least_m"] for r in found if r["mode"] == mode)
        rows.append(
            {"name": f"{scene} {mode}", "seeds": len(seeds), "steady_m": mean, "low_m": low,
             "high_m": high, "least_m": least}
        )  # fmt: skip
    name = f"{scene} {WHOLE} - {MOUNTS}"
    mean, low, high = bootstrap([steady[WHOLE, s] - steady[MOUNTS, s] for s in seeds])
    rows.append({"name": name, "seeds": len(seeds), "steady_m": mean, "low_m": low, "high_m": high})
    return rows, Check(f"{name}, steady", mean, "m", FARTHER, at_least=True)
