"""Ticks of a short run, and an engine that only hands them on, for tests of recordings."""

from dataclasses import replace
from functools import cache

from app.actions import AddObstacle, RemoveObstacle, SetMode, SetParams
from app.messages import Mode
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine

SETUP = Setup(scene="cell", seed=1, rate=125.0, program="door-screws")
ASKED = {
    20: AddObstacle("ball", {"kind": "sphere", "radius_m": 0.08}, (0.5, 0.5, 0.5)),
    40: SetMode(Mode.HOLDING),
    60: SetParams({"mode": "wb"}),
    70: SetMode(Mode.STOPPED, "a person said so"),
    80: SetMode(Mode.RUNNING),
    90: RemoveObstacle("ball"),
}


def new_engine():
    return build_engine(SETUP, ManualClock())


@cache
def run():
    """The engine after 120 ticks with people's wishes in them, the ticks, and their snapshots."""
    engine = new_engine()
    ticks, snapshots = engine.subscribe(1000), []
    for i in range(120):
        if i in ASKED:
            engine.post(ASKED[i])
        snapshots.append(engine.step())
    return engine, ticks.take(), snapshots


class Handing:
    """Hands its followers the ticks of `run` over and over, as those of one long run."""

    def __init__(self):
        engine, self._ticks, self._snapshots = run()
        self.brain, self.plant, self.scene = engine.brain, engine.plant, engine.scene
        self.said, self.tick, self._followers = [], 0, []
        self.post = self.said.append
        self.snapshots = self
        self.looked = 0

    def get(self):
        """The newest snapshot, and when that was."""
        self.looked += 1
        return self._snapshots[self.tick % len(self._snapshots)], 0.0

    def follow(self, follower):
        self._followers.append(follower)

    def unfollow(self, follower):
        self._followers.remove(follower)

    def hand(self, count):
        for _ in range(count):
            x, out = self._ticks[self.tick % len(self._ticks)]
            x = replace(x, tick=self.tick, now=self.tick / SETUP.rate)
            for follower in self._followers:
                follower.put((x, out))
            self.tick += 1


def same_outputs(recording, brain):
    """Give a brain all Inputs of a recording: the ticks at which it does something else."""
    from app.record.witness import WitnessOf

    head, witness = recording.head, WitnessOf()
    if head.state is not None:
        brain.restore(brain.read(head.state))
    return [
        i for i in range(len(recording))
        if witness(brain.tick(recording.inputs(i))).digests != recording.witness(i).digests
    ]  # fmt: skip
