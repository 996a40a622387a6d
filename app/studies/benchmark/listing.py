"""The list of what the benchmark asks: versioned, with a digest that stands beside every result."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Annotated, NamedTuple

from msgspec import Meta, structs

from app.assets import asset_folder
from app.control.guests.files import is_guest
from app.errors import ConfigError, options
from app.studies.benchmark.attempt import SCENE, condition_of
from app.studies.conditions import ALONE, SHORT
from app.studies.trial import TrialSpec
from app.toml import Name, NotNegative, Positive, Table, read_toml
from app.world.scene import find_scene

ASKED = {mode: short for short, mode in SHORT.items()}  # a controller may be named by its mode
Count = Annotated[int, Meta(ge=1)]


class SetTable(Table, frozen=True):
    """One `[[set]]`; see the list itself."""

    name: Name
    seconds: Positive
    scene: str = ""
    experiment: str = ""
    sides: tuple[str, ...] = ("",)
    change: str = ""
    work: bool = False
    quick_s: NotNegative = 0.0

    @property
    def what(self) -> str:
        """As a trial calls it."""
        return self.experiment or f"{SCENE}:{self.scene}"


class ListTable(Table, frozen=True):
    """The whole list."""

    version: int
    world: str
    distance_kept_m: Positive
    seeds: Count
    quick_seeds: Count
    rate_hz: Positive
    set: tuple[SetTable, ...]


class Slot(NamedTuple):
    """What is the same for every controller: which set, which side, which seed; alone: with nobody
    there."""

    set: str
    side: str
    seed: int
    alone: bool = False


@dataclass(frozen=True)
class Benchmark:
    """A list as it is run.

    quick: only the sets that are short, for a shorter time.   seeds: of each set.
    """

    table: ListTable
    digest: str
    quick: bool
    seeds: int

    @property
    def sets(self) -> tuple[SetTable, ...]:
        """Those that are run."""
        return tuple(s for s in self.table.set if s.quick_s or not self.quick)

    @property
    def title(self) -> str:
        """Which benchmark it is, in a line."""
        kind = "quick, " if self.quick else ""
        return (
            f"Flinch benchmark, version {self.table.version} ({kind}list {self.digest}, "
            f"{self.seeds} seeds, {self.table.world} world, "
            f"{self.table.distance_kept_m:g} m to keep)"
        )

    def seconds(self, s: SetTable) -> float:
        """[s] of each trial of a set."""
        return s.quick_s if self.quick else s.seconds

    def specs(self, s: SetTable, controller: str) -> dict[Slot, TrialSpec]:
        """The trials of a controller in a set."""
        slots = [Slot(s.name, side, i) for i, side in product(range(self.seeds), s.sides)]
        slots += [Slot(s.name, "", 0, alone=True)] if s.work else []
        return {slot: self._spec(s, controller, slot) for slot in slots}

    def _spec(self, s: SetTable, controller: str, slot: Slot) -> TrialSpec:
        t = self.table
        name = ASKED.get(controller, controller) + slot.side
        name += f"{s.change}+set:distance_kept={t.distance_kept_m:g}" + ALONE * slot.alone
        return TrialSpec(s.what, name, slot.seed, self.seconds(s), t.rate_hz, t.world)

    def check(self, controllers: Sequence[str]) -> None:
        """ConfigError for a controller that there is not, or that a set cannot have."""
        for s, controller in product(self.sets, controllers):
            for spec in self.specs(s, controller).values():
                condition_of(spec)


def read_list(path: Path | None = None, quick: bool = False, seeds: int | None = None) -> Benchmark:
    """The shipped list, or another one; ConfigError for one that cannot be used."""
    path = path or asset_folder("static_assets") / "benchmark" / "list.toml"
    table = read_toml(path, ListTable, ConfigError)
    sha = hashlib.blake2b(path.read_bytes(), digest_size=4)
    names = [s.name for s in table.set]
    for s in table.set:
        if bool(s.scene) == bool(s.experiment):
            raise ConfigError(f"{path}: set {s.name!r}: give either a scene or an experiment")
        if names.count(s.name) > 1:
            raise ConfigError(f"{path}: two sets are called {s.name!r}; give one another name")
        if s.scene:
            sha.update(find_scene(s.scene).read_bytes())
    wanted = seeds or (table.quick_seeds if quick else table.seeds)
    return Benchmark(table, sha.hexdigest(), quick, wanted)


def only_sets(bench: Benchmark, names: Sequence[str]) -> Benchmark:
    """Only the sets of these names; ConfigError for one that there is not."""
    known = {s.name: s for s in bench.sets}
    for name in names:
        if name not in known:
            raise ConfigError(f"no set {name!r}; {options(name, known)}")
    return replace(bench, table=structs.replace(bench.table, set=tuple(known[n] for n in names)))


def short_name(controller: str) -> str:
    """What a table calls it: a guest by its file, without the way there."""
    return controller.replace("\\", "/").rpartition("/")[2] if is_guest(controller) else controller
