"""A walking person of capsules, as a pure function of time.

Sizes in the base frame with the table top at z = 0 and the floor at z = -0.75 m: a person of
1.57 m. The person walks a route, swings legs and arms with the way walked, and at a stop
turns to a point and reaches for it with one hand. The person never reacts to the robot.
"""

from dataclasses import dataclass, replace

import numpy as np

from app.messages import Array, freeze
from app.world.limbs import bent_arm, capsule_poses, hanging_arm, leg, rotated
from app.world.route import Route, Stage, smoothstep
from app.world.shapes import capsule
from app.world.world import Body, Colour

RISE = 0.8  # s, in which a hand is put out or taken back
TURN = 1.2  # s, in which a turn is made
PAUSE = 2 * TURN  # s: who stays at least so long turns before leaving, others on the way
STRIDE = 1.1  # m of way in a full cycle of both legs
LEG_SWING, ARM_SWING = 0.40, 0.45  # rad to either side at PACE
PACE = 0.6  # m/s
LATERAL = 0.04  # m, largest shift of a route by seed
SKIN, SHIRT, TROUSERS = (222, 184, 155), (74, 111, 165), (62, 68, 82)
PARTS: dict[str, tuple[float, float, Colour]] = {  # radius, straight length [m], colour
    "torso": (0.16, 0.50, SHIRT),
    "head": (0.11, 0.02, SKIN),
    "left leg": (0.08, 0.57, TROUSERS),
    "right leg": (0.08, 0.57, TROUSERS),
    "left upper arm": (0.055, 0.28, SHIRT),
    "left forearm": (0.045, 0.38, SKIN),
    "right upper arm": (0.055, 0.28, SHIRT),
    "right forearm": (0.045, 0.38, SKIN),
}
TRUNK = np.array([[[0, 0, -0.05], [0, 0, 0.45]], [[0, 0, 0.69], [0, 0, 0.71]]])  # torso, head


@dataclass(frozen=True, eq=False)
class Plan:
    """What a person is to do.

    route: stops (n, 3) [m], base frame, over the ground at z = 0.
    reach: (n, 3) [m], base frame: where a hand goes at each stop, NaN where nowhere.
    hand:  which reaches, 0 left, 1 right.
    start: [s] into the route at time zero.
    """

    name: str
    route: Route
    reach: Array
    hand: int = 1
    start: float = 0.0


def varied(plan: Plan, rng: np.random.Generator) -> Plan:
    """The plan with another speed (x 0.8..1.2), lateral shift and, on a loop, start."""
    route = plan.route
    way = route.stops[1] - route.stops[0]
    aside = np.array([-way[1], way[0], 0.0]) / np.hypot(way[0], way[1])
    stops = freeze(route.stops + rng.uniform(-LATERAL, LATERAL) * aside)
    route = Route(stops, route.dwell, route.speed * rng.uniform(0.8, 1.2), route.loop)
    start = rng.uniform(0.0, route.period) if route.loop else plan.start
    return replace(plan, route=route, start=start)


class Walker:
    """All parts of one person at a time; the last answer is kept, since every part asks."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._looks = _looks(plan)
        self._last: tuple[float, dict[str, Array]] = (np.nan, {})

    def poses(self, t: float) -> dict[str, Array]:
        """T_base_part (4, 4) of every part by name."""
        stamp, poses = self._last
        if t != stamp:
            poses = dict(zip(PARTS, self._compute(t), strict=True))
            self._last = (t, poses)  # in one piece: two worlds of one scene share a walker
        return poses

    def _compute(self, t: float) -> Array:
        stage = self.plan.route.at(t + self.plan.start)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotated(self._heading(stage)), stage.position
        vigour = min(stage.speed / PACE, 1.3) * np.sin(2 * np.pi * stage.way / STRIDE)
        legs = [leg(side, side * LEG_SWING * vigour) for side in (1, -1)]
        arms = [hanging_arm(side, -side * ARM_SWING * vigour) for side in (1, -1)]
        out = self._reaching(stage)
        if out > 0.0:
            target = (self.plan.reach[stage.stop] - stage.position) @ T[:3, :3]
            arm = arms[self.plan.hand]
            # up before ahead, over the edge of a table
            ahead, up = smoothstep(1.5 * out - 0.5), smoothstep(1.5 * out)
            hand = arm[1, 1] + (target - arm[1, 1]) * [ahead, ahead, up]
            arms[self.plan.hand] = bent_arm(arm[0, 0], hand)
        ends = np.array([*TRUNK, *legs, *arms[0], *arms[1]])
        return T @ capsule_poses(ends)

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

    def _reaching(self, stage: Stage) -> float:
        """0 hand hanging .. 1 hand at its target, growing evenly, in the second part of a turn."""
        if stage.moving or np.isnan(self.plan.reach[stage.stop, 0]):
            return 0.0
        inside = min(stage.elapsed, stage.duration - stage.elapsed) - (TURN - RISE)
        return min(max(inside / RISE, 0.0), 1.0)


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """The motion of one part of a person."""

    walker: Walker
    name: str

    def pose(self, t: float) -> Array:
        return self.walker.poses(t)[self.name]


def person_bodies(plan: Plan) -> list[Body]:
    """The parts of one person, named like `person/torso`; nobody can drag them."""
    walker = Walker(plan)
    return [
        Body(f"{plan.name}/{name}", capsule(radius, length), colour, Part(walker, name), False)
        for name, (radius, length, colour) in PARTS.items()
    ]


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


def _turned(before: float, after: float, elapsed: float) -> float:
    """The shorter way from one heading to another, `elapsed` [s] after it began."""
    turn = (after - before + np.pi) % (2 * np.pi) - np.pi
    return float(before + turn * smoothstep(elapsed / TURN))
