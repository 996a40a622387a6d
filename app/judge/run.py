"""What a run was like: the truth about an engine, which does not know that it is watched."""

import re
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.judge.truth import TrueDistance
from app.messages import Array, Mode, Snapshot
from app.plant.simulated import SimulatedPlant
from app.runtime import Engine
from app.world.world import World

DISTAL = 3  # joints that move a link which can be moved in every direction
JUDGED_EVERY = 0.02  # [s] true distances are exact and cost a millisecond


@dataclass
class Record:
    """What was seen along a run; distances in metres, over time in `stamp` [s]."""

    began: float = 0.0  # [s]
    stamp: list[float] = field(default_factory=list)
    true_distance: list[float] = field(default_factory=list)
    distal_distance: list[float] = field(default_factory=list)  # of what three joints move
    seen_distance: list[float] = field(default_factory=list)
    activation: list[float] = field(default_factory=list)
    lowest: float = np.inf  # [m] of any point of what moves, above the base's x-y plane
    ticks: int = 0
    avoiding: int = 0  # ticks in which the avoidance acted
    blind: float = 0.0  # sum over the ticks of what could not be told
    reasons: Counter[str] = field(default_factory=Counter)  # ticks with each mode's reason
    advice: Counter[str] = field(default_factory=Counter)  # ticks with each advice
    stops: list[dict[str, object]] = field(default_factory=list)
    warnings: tuple[str, ...] = ()  # what a person should know before it starts
    overspeed: float = -np.inf  # [rad/s] largest excess over a velocity limit
    overreach: float = -np.inf  # [rad] largest excess over a position limit

    def steady(self, seconds: float) -> float:
        """Mean true distance [m] over the last `seconds`."""
        last = np.array(self.stamp) > self.stamp[-1] - seconds
        return float(np.mean(np.array(self.true_distance)[last]))


class Judge:
    """Watches an engine and knows the truth; the engine does not know the judge."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        plant = engine.plant
        self._plant = plant if isinstance(plant, SimulatedPlant) else None
        robot = self._plant.robot if self._plant else engine.robot  # as it truly is
        self._moving = np.flatnonzero(robot.supports.any(axis=1))
        self._distal = distal(robot.supports)[self._moving]
        self._truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
        self._world = self._plant.world if self._plant else World(())
        shapes = self._world.shapes()
        self._cell = [b.name for b in engine.cell.boxes if b.name in shapes]  # never avoided
        self._points = [b.vertices[np.unique(b.faces)] for b in robot.bodies]
        self._next = -np.inf
        self._mode = Mode.RUNNING
        self.record = Record()

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        r, robot = self.record, self._engine.robot
        r.overspeed = max(r.overspeed, float((np.abs(s.joints.qd) - robot.qd_max).max()))
        outside = np.maximum(s.joints.q - robot.q_max, robot.q_min - s.joints.q)
        r.overreach = max(r.overreach, float(outside.max()))
        if s.status.mode is Mode.STOPPED and self._mode is not Mode.STOPPED:
            r.stops.append({"at": s.stamp - r.began, "reason": s.status.reason})
        self._mode = s.status.mode
        r.ticks += 1
        r.avoiding += s.command.activation > 0.0
        r.blind += s.blind
        r.reasons[f"{s.status.mode.value}: {s.status.reason}"] += 1
        if s.advice:
            r.advice[_without_figures(s.advice)] += 1
        if s.stamp >= self._next:
            self._next = s.stamp + JUDGED_EVERY
            T_base_link = self._plant.true_poses() if self._plant else s.T_base_link
            true = self._truth.measure(T_base_link, self._world, self._cell)[self._moving]
            r.stamp.append(s.stamp)
            r.true_distance.append(float(true.min()))
            r.distal_distance.append(float(true[self._distal].min()))
            r.seen_distance.append(float(s.body.distance[self._moving].min()))
            r.activation.append(s.command.activation)
            for i in self._moving:  # the base stands on the table for ever
                T = T_base_link[i]
                r.lowest = min(r.lowest, float((self._points[i] @ T[2, :3]).min() + T[2, 3]))


def distal(supports: Array) -> NDArray[np.bool_]:
    """(L,) links that `DISTAL` joints move, or of an arm with fewer, all its joints; `supports`
    (L, n)."""
    joints = supports.sum(axis=1)
    return np.asarray(joints >= max(1.0, min(DISTAL, float(joints.max()))))


def _without_figures(words: str) -> str:
    """The same advice with other figures in it is the same advice."""
    return re.sub(r"\d+(\.\d+)?", "#", words)
