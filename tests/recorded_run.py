"""A short run of the cell, kept in memory, with what people do in it."""

from app.actions import AddObstacle, SetMode, SetParams
from app.config import Params
from app.messages import Mode
from app.record.head import head_of
from app.record.kept import Kept
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine

CELL = Setup(scene="cell", seed=1, rate=125.0, program="door-screws")
BALL = {"kind": "sphere", "radius_m": 0.08}
ACTIONS = {
    40: AddObstacle("ball", BALL, (0.5, 0.5, 0.5)),
    80: SetParams({"distance_kept": 0.3}),
    120: SetMode(Mode.STOPPED),
    160: SetMode(Mode.RUNNING),
}


def kept_run(seconds=3.0, setup=CELL, actions=ACTIONS, params=None):
    """The recording of a run in which people do `actions`, by the tick before which they ask."""
    engine = build_engine(setup, ManualClock(), params or Params())
    head = head_of(setup, engine)
    ticks, bodies = engine.subscribe(100_000), []
    for i in range(round(seconds * setup.rate)):
        if i in actions:
            engine.post(actions[i])
        bodies.append(engine.step().world)
    engine.close()
    return Kept(head, ticks.take(), bodies)
