"""What the people of a simulated world do, noted as it begins: for who looks at a trial's course.

It is read off their plans, which no controller knows.
"""

from typing import Any

from app.messages import Snapshot
from app.plant.simulated import SimulatedPlant
from app.runtime import Engine
from app.world.person import PartMotion, Walker
from app.world.world import World

STAYS = ""


def watch_moves(engine: Engine) -> "Moves":
    """For a `Case`: watches the people around an engine."""
    plant = engine.plant
    assert isinstance(plant, SimulatedPlant)
    return Moves(plant.world)


class Moves:
    """Hand `update` every snapshot of a run in a world, then ask for `marks`."""

    def __init__(self, world: World) -> None:
        self._world = world
        motions = [b.motion for b in self._world.bodies if isinstance(b.motion, PartMotion)]
        movers = {id(m.walker): m.walker for m in motions}
        self._walkers = [w for w in movers.values() if isinstance(w, Walker)]
        self._now: list[str] = []
        self._marks: list[list[Any]] = []

    def update(self, s: Snapshot) -> None:
        """Note who begins something else in this tick."""
        now = [doing(w, self._world.time) for w in self._walkers]
        for walker, before, words in zip(self._walkers, self._now, now, strict=False):
            if words not in (before, STAYS):
                who = f"{walker.plan.name} " if len(self._walkers) > 1 else ""
                self._marks.append([round(s.stamp, 3), who + words])
        self._now = now

    def figures(self) -> dict[str, Any]:
        """None: it only tells what happens."""
        return {}

    def marks(self) -> list[list[Any]]:
        """[stamp [s], words] of everything that was begun."""
        return self._marks


def doing(walker: Walker, t: float) -> str:
    """What a walking person does at `t` [s] of the world: walks, reaches, or just stays."""
    plan = walker.plan
    stage = plan.route.at(t + plan.start)
    places = plan.places or ("",) * len(plan.route.stops)
    if stage.moving:
        to = places[(stage.stop + 1) % len(places)]
        return f"walks to {to}" if to else "walks on"
    if walker.reaching(stage) > 0.0:
        here = places[stage.stop]
        return f"reaches at {here}" if here else "reaches"
    return STAYS
