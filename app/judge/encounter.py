"""What a run beside people was like: it watches an engine, and knows the truth."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from app.judge import metrics
from app.judge.clouds import CloudDistance
from app.judge.contact import TOUCHING, Contacts, led_away
from app.judge.least import LeastDistance, Nearest, NearestNow
from app.judge.truth import TrueDistance
from app.messages import Array, Mode, Snapshot
from app.plant.simulated import SimulatedPlant
from app.runtime import Engine

JUDGED_EVERY = 0.02  # [s] the truth is asked
LOOKED_EVERY = 1.0 / 15.0  # [s] clouds are compared: as often as sensors measure


@dataclass
class Notes:
    """What was noted; of every tick, at times judged, and at times looked."""

    qd: list[Array] = field(default_factory=list)
    tool: list[Array] = field(default_factory=list)
    goal: list[Array] = field(default_factory=list)
    jump: list[float] = field(default_factory=list)
    progress: list[float] = field(default_factory=list)
    stamp: list[float] = field(default_factory=list)
    true: list[float] = field(default_factory=list)
    link: list[int] = field(default_factory=list)
    led: list[float] = field(default_factory=list)  # [m/s] see `led_away`
    activation: list[float] = field(default_factory=list)
    paper: list[float] = field(default_factory=list)
    away: list[float] = field(default_factory=list)
    looked: list[float] = field(default_factory=list)
    acts: list[float] = field(default_factory=list)  # activation, when looked
    true_then: list[float] = field(default_factory=list)  # when looked
    reached: int = 0
    stops: int = 0


class Encounter:
    """Hand `update` every snapshot of a simulated engine, then ask for `figures`.

    The bodies of the engine's known cell are no environment: the arm works on them.
    """

    def __init__(self, engine: Engine) -> None:
        plant = engine.plant
        assert isinstance(plant, SimulatedPlant)
        self._plant, self._engine, robot = plant, engine, plant.robot  # as it truly is
        self._truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
        moving = np.flatnonzero(robot.supports.any(axis=1))
        self._shapes = plant.world.shapes()
        cell = [b.name for b in engine.cell.boxes if b.name in self._shapes]
        self._near = NearestNow(self._truth, robot, moving, plant.world, cell)
        others = [name for name in self._shapes if name not in cell]
        self._cell = LeastDistance(self._truth, robot, moving, plant.world, others)
        avoided = {n: s for n, s in self._shapes.items() if n not in cell}
        self._contacts = Contacts(robot, self._truth, avoided)
        self._clouds = CloudDistance(engine.robot, moving)  # the paper's is the believed robot
        self._judged = self._looked = -np.inf
        self._touching = False
        self._mode = Mode.RUNNING
        self.notes = Notes()

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        n = self.notes
        n.qd.append(s.command.qd)
        n.tool.append(s.T_base_tool[:3, 3])
        n.goal.append(s.goal.T_base_tool[:3, 3])
        n.jump.append(s.jump)
        n.progress.append(s.command.progress)
        n.reached = s.reached
        n.stops += s.status.mode is Mode.STOPPED and self._mode is not Mode.STOPPED
        self._mode = s.status.mode
        if s.stamp < self._judged + JUDGED_EVERY:
            return
        self._judged, T = s.stamp, self._plant.true_poses()
        nearest = self._near.update(T, s.world)
        self._cell.update(T, s.world)
        self._touch(nearest, T, s)
        n.stamp.append(s.stamp)
        n.true.append(max(nearest.distance, 0.0))
        n.link.append(nearest.link)
        self._note_led(nearest, T, s)
        n.activation.append(s.command.activation)
        if s.stamp >= self._looked + LOOKED_EVERY:
            self._looked = s.stamp
            n.looked.append(s.stamp)
            n.acts.append(s.command.activation)
            n.paper.append(self._clouds.measure(s.T_base_link, s.cloud.kept()))
            n.true_then.append(nearest.distance)
            n.away.append(self._away(nearest, s))

    def _touch(self, nearest: Nearest, T: Array, s: Snapshot) -> None:
        """Who ran into whom, while there is a touch and once after it."""
        before, self._touching = self._touching, nearest.distance <= TOUCHING
        if before or self._touching:
            bodies = [b for b in s.world if b.view.name in self._contacts.shapes]
            self._contacts.update(s.stamp, s.joints.q, s.joints.qd, T, bodies)

    def _away(self, nearest: Nearest, s: Snapshot) -> float:
        """[m] from the point of the world that is truly nearest to the nearest perceived one."""
        if nearest.on_body is None or not nearest.distance < metrics.NEAR:
            return np.inf
        points = np.concatenate([s.cloud.kept(), s.memory])
        if not len(points):
            return np.inf
        return float(np.linalg.norm(points - nearest.on_body, axis=1).min())

    def _note_led(self, nearest: Nearest, T: Array, s: Snapshot) -> None:
        """Note how fast the arm leads itself away from the nearest point; zero where none is within
        reach of avoidance."""
        led = 0.0
        if nearest.on_body is not None and nearest.distance < s.params.avoidance_begins:
            posture = self._plant.robot.posture(s.joints.q)
            led = led_away(posture, s.joints.qd, T, nearest.on_body)
        self.notes.led.append(led)

    def course(self) -> dict[str, list[float]]:
        """What is drawn over time, as often as clouds are compared: to a tenth of a millimetre."""
        n = self.notes
        columns = {
            "stamp_s": n.looked, "paper_m": n.paper, "true_m": n.true_then, "activation": n.acts,
        }  # fmt: skip
        return {name: np.round(values, 4).tolist() for name, values in columns.items()}

    def figures(self, kept: float, rate: float) -> dict[str, Any]:
        """All figures of the run; kept: [m] the distance to keep.   rate: [Hz] of ticks."""
        n, seconds = self.notes, len(self.notes.qd) / rate
        true, paper = np.array(n.true), np.array(n.paper)
        stamp, activation = np.array(n.stamp), np.array(n.activation)
        finite = np.isfinite(paper)
        least, low = metrics.least_and_low(true)
        links = [self._engine.robot.links[i] if i >= 0 else "" for i in n.link]
        reactions = metrics.reaction_times(stamp, true, activation, kept)
        begins = self._engine.brain.params.avoidance_begins
        led = metrics.own_reaction_times(stamp, true, np.array(n.led), begins)
        return {
            "paper_mean_m": metrics.mean_minimum([paper]),
            "paper_std_m": metrics.largest_deviation([paper]),
            "paper_share": float(finite.mean()),
            "true_mean_m": metrics.mean_minimum([true]),
            "true_std_m": metrics.largest_deviation([true]),
            "true_least_m": least,
            "true_p5_m": low,
            "below_kept": metrics.share_below(true, kept),
            "shortfall_m": metrics.shortfall(true, kept),
            "contacts": metrics.contacts(true),
            "own_contacts": sum(c.moved_into for c in self._contacts.found),
            "own_mps": max((c.own for c in self._contacts.found), default=0.0),
            "cell_least_m": self._cell.least,
            "waypoints": n.reached,
            "waypoints_per_min": 60.0 * n.reached / seconds,
            "path_error_m": metrics.path_error(np.array(n.tool), np.array(n.goal)),
            "jerk_rms": metrics.jerk_rms(np.array(n.qd), rate),
            "effort": metrics.effort(np.array(n.qd), rate),
            "held_back": float(np.mean(np.array(n.progress) < metrics.HELD_BACK)),
            "jumps_per_s": metrics.jumps_per_second(np.array(n.jump), seconds),
            "reactions": len(reactions),
            "reaction_s": float(np.median(reactions)) if reactions else np.nan,
            "own_reaction_s": float(np.median(led)) if led else np.nan,
            "seen_share": metrics.seen_share(np.array(n.true_then), np.array(n.away)),
            "avoiding_share": float(np.mean(activation > metrics.ACTS)),
            "stops": n.stops,
            "nearest_link": metrics.shares(links),
        }
