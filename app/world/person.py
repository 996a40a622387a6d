"""A walking person of capsules, as a pure function of time.

The person walks a route, swings legs and arms with the way walked, and at a stop turns to a
point, bows and squats as far as needed, and reaches for it with one hand. The person never
reacts to the robot. Base frame, with the table top at z = 0 and the floor at z = -0.75 m.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from app.messages import Array, freeze
from app.world.build import MIDDLE, PARTS, SHORT, TALL, shape_of_part
from app.world.figure import Stance, bow, figure, hanging_hand
from app.world.gait import ARM_SWING, NATURAL, stride, swing
from app.world.limbs import capsule_poses, rotated
from app.world.route import Route, Stage, smoothstep
from app.world.world import Body

RISE = 0.8  # s, in which a hand is put out or taken back, at least
TURN = 1.2  # s, in which a turn is made
PAUSE = 2 * TURN  # s: who stays at least so long turns before leaving, others on the way
LATERAL = 0.04  # m, largest shift of a route by seed
ASIDE = 0.05  # m, largest shift of a reach by seed, each way
VISITS = 40  # stops of a varied order before it begins anew


@dataclass(frozen=True, eq=False)
class Plan:
    """What a person is to do.

    route: stops (n, 3) [m], base frame, over the ground at z = 0.
    reach: (n, 3) [m], base frame: where a hand goes at each stop, NaN where nowhere.
    hand:  which reaches, 0 left, 1 right.
    start: [s] into the route at time zero.
    stature: [m].
    places: names of the stops, '' for those without one; empty: none has one.
    """

    name: str
    route: Route
    reach: Array
    hand: int = 1
    start: float = 0.0
    stature: float = MIDDLE
    places: tuple[str, ...] = ()


def varied(plan: Plan, rng: np.random.Generator, stature: bool, order: bool) -> Plan:
    """The plan with another speed (x 0.8..1.2), lateral shift and, on a loop, start.

    stature: draw it.   order: draw which stop comes next, how long it takes (x 0.5..1.5) and,
    within `ASIDE`, where the hand goes.
    """
    route, reach, places = plan.route, plan.reach, plan.places
    way = route.stops[1] - route.stops[0]
    aside = np.array([-way[1], way[0], 0.0]) / np.hypot(way[0], way[1])
    stops, dwell = route.stops + rng.uniform(-LATERAL, LATERAL) * aside, route.dwell
    speed, began = route.speed * rng.uniform(0.8, 1.2), rng.uniform()
    tall = float(rng.uniform(SHORT, TALL)) if stature else plan.stature
    if order:
        visits = _visits(len(stops), rng)
        stops, reach = stops[visits], reach[visits] + rng.uniform(-ASIDE, ASIDE, (VISITS, 3))
        places = tuple(places[i] for i in visits) if places else ()
        dwell = np.maximum(dwell[visits] * rng.uniform(0.5, 1.5, VISITS), PAUSE)
    route = Route(freeze(stops), freeze(dwell), speed, route.loop)
    start = began * route.period if route.loop else plan.start
    return replace(plan, route=route, reach=freeze(reach), start=start, stature=tall, places=places)


def _visits(stops: int, rng: np.random.Generator) -> list[int]:
    """`VISITS` stops, none twice in a row, nor the first after the last."""
    order = [0]
    while len(order) < VISITS:
        last = len(order) == VISITS - 1
        others = [i for i in range(stops) if i != order[-1] and not (last and i == order[0])]
        order.append(int(rng.choice(others or [i for i in range(stops) if i != order[-1]])))
    return order


@dataclass(frozen=True, eq=False)
class Walker:
    """All parts of one person at a time; the last answer is kept, since every part asks."""

    plan: Plan
    _looks: Array = field(init=False)
    _bows: Array = field(init=False)  # (n, 2) lean and squat [rad] at each stop
    _last: list[tuple[float, dict[str, Array]]] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_looks", _looks(self.plan))
        object.__setattr__(self, "_bows", _bows(self.plan))
        object.__setattr__(self, "_last", [(np.nan, {})])

    def poses(self, t: float) -> dict[str, Array]:
        """T_base_part (4, 4) of every part by name."""
        stamp, poses = self._last[0]
        if t != stamp:
            poses = dict(zip(PARTS, self._compute(t), strict=True))
            self._last[0] = (t, poses)  # in one piece: two worlds of one scene share a walker
        return poses

    def _compute(self, t: float) -> Array:
        plan = self.plan
        stage = plan.route.at(t + plan.start)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotated(self._heading(stage)), stage.position
        return T @ capsule_poses(self._ends(stage, T))

    def _ends(self, stage: Stage, T: Array) -> Array:
        """Ends (17, 2, 3) of all parts in the walker's frame, which is at T (4, 4)."""
        plan, out = self.plan, self.reaching(stage)
        lean, squat = self._bows[stage.stop] * smoothstep(out)
        stance = replace(_walking(stage, plan), lean=float(lean), squat=float(squat))
        if out == 0.0:
            return figure(stance, plan.stature)
        target = (plan.reach[stage.stop] - stage.position) @ T[:3, :3]
        # up before ahead, over the edge of a table
        ahead, up = smoothstep(1.5 * out - 0.5), smoothstep(1.5 * out)
        hangs = hanging_hand(stance, plan.stature, plan.hand)
        hand = hangs + (target - hangs) * [ahead, ahead, up]
        return figure(stance, plan.stature, plan.hand, hand)

    def _heading(self, stage: Stage) -> float:
        """Where the person looks [rad about z]."""
        came, gaze, ahead = self._looks[:, stage.stop]
        stays = self.plan.route.dwell[stage.stop] >= PAUSE
        if stage.moving:
            return float(ahead) if stays else _turned(came, ahead, stage.elapsed)
        if not stays:
            return float(came)
        left = stage.duration - stage.elapsed
        return _turned(_turned(came, gaze, stage.elapsed), ahead, TURN - left)

    def reaching(self, stage: Stage) -> float:
        """0 hand hanging .. 1 hand at its target, growing evenly, in the second part of a turn.

        Who bows deeply takes all of it.
        """
        if stage.moving or np.isnan(self.plan.reach[stage.stop, 0]):
            return 0.0
        rise = RISE + (TURN - RISE) * min(float(self._bows[stage.stop].sum()), 1.0)
        inside = min(stage.elapsed, stage.duration - stage.elapsed) - (TURN - rise)
        return min(max(inside / rise, 0.0), 1.0)


class Mover(Protocol):
    """Whoever knows where all parts of a person are, T_base_part (4, 4) by name, at a time [s]."""

    def poses(self, t: float) -> dict[str, Array]: ...


@dataclass(frozen=True, eq=False, slots=True)
class PartMotion:
    """The motion of one part of a person."""

    walker: Mover
    name: str

    def pose(self, t: float) -> Array:
        return self.walker.poses(t)[self.name]


def person_bodies(plan: Plan) -> list[Body]:
    """The parts of one person, named like `person/chest`; nobody can drag them."""
    walker = Walker(plan)
    return [
        Body(
            f"{plan.name}/{name}", shape_of_part(name, plan.stature), part.colour,
            PartMotion(walker, name), False,
        )
        for name, part in PARTS.items()
    ]  # fmt: skip


def _walking(stage: Stage, plan: Plan) -> Stance:
    """Legs and arms on the way; at rest all angles are zero."""
    step = stride(plan.route.speed, plan.stature)
    vigour = step / (NATURAL * plan.stature) * min(stage.speed / plan.route.speed, 1.0)
    share = stage.way / step
    legs = vigour * np.array([swing(share), swing(share + 0.5)])
    # an arm goes ahead with the other side's leg
    arms = vigour * ARM_SWING * np.cos(2.0 * np.pi * (share + np.array([0.5, 0.0])))
    return Stance(legs, arms)


def _looks(plan: Plan) -> Array:
    """Where the person looks [rad about z] on arriving, staying and leaving, (3, n)."""
    stops = plan.route.stops
    ways = np.roll(stops, -1, axis=0) - stops
    ahead = np.arctan2(ways[:, 1], ways[:, 0])
    came = np.roll(ahead, 1)
    if not plan.route.loop:  # nobody comes to the first stop, nor leaves the last
        came[0], ahead[-1] = ahead[0], came[-1]
    gaze = plan.reach - stops
    stay = np.arctan2(gaze[:, 1], gaze[:, 0])
    return np.array([came, np.where(np.isnan(stay), came, stay), ahead])


def _bows(plan: Plan) -> Array:
    """Lean and squat [rad] with which each stop's reach succeeds, (n, 2)."""
    gaze = plan.reach - plan.route.stops
    return np.array([
        [0.0, 0.0] if np.isnan(g[0]) else bow(np.array([np.hypot(g[0], g[1]), 0.0, g[2]]),
                                             plan.hand, plan.stature)
        for g in gaze
    ])  # fmt: skip


def _turned(before: float, after: float, elapsed: float) -> float:
    """The shorter way from one heading to another, `elapsed` [s] after it began."""
    turn = (after - before + np.pi) % (2 * np.pi) - np.pi
    return float(before + turn * smoothstep(elapsed / TURN))
