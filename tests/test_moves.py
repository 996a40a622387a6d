"""When people of a world begin to walk and to reach is noted as it happens."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np

from app.studies.moves import Moves, doing
from app.world.person import PartMotion, Walker, person_bodies
from app.world.scene import find_scene, load_scene
from app.world.world import World


def walkers(scene):
    motions = [b.motion for b in scene.bodies if isinstance(b.motion, PartMotion)]
    return list({id(m.walker): m.walker for m in motions}.values())


def test_a_person_of_the_cell_walks_between_named_places_and_reaches_there():
    (walker,) = walkers(load_scene(find_scene("cell-left"), seed=3))
    words = [doing(walker, t) for t in np.arange(0.0, 200.0, 0.1)]
    begun = [b for a, b in pairwise(words) if a != b and b]
    places = ("the toolbox", "the door", "the waiting place")
    assert {f"walks to {p}" for p in places} <= set(begun)
    assert {w for w in begun if w.startswith("reaches")} == {f"reaches at {p}" for p in places[:2]}
    for before, now in pairwise(begun):
        if now.startswith("reaches"):  # where one has just come to
            assert before.removeprefix("walks to ") == now.removeprefix("reaches at ")
        else:
            assert not (before.startswith("walks") and before == now)


def test_a_plan_without_names_is_told_without_them():
    (walker, *_) = walkers(load_scene(find_scene("cell"), seed=0))
    assert isinstance(walker, Walker) and not any(walker.plan.places)
    said = {doing(walker, t) for t in np.arange(0.0, 30.0, 0.1)}
    assert said == {"", "walks on", "reaches"}


def test_moves_are_noted_when_the_person_begins_them():
    scene = load_scene(find_scene("cell-left"), seed=0)
    (walker,), world = walkers(scene), World(scene.bodies)
    moves, stamps = Moves(world), np.arange(0.0, 20.0, 0.05)
    for stamp in stamps.tolist():
        world.step(stamp)
        moves.update(SimpleNamespace(stamp=stamp + 7.0))  # the clock began before the world
    words = [doing(walker, t) for t in stamps]
    begun = [
        [round(t + 7.0, 3), now]
        for t, (before, now) in zip(stamps[1:].tolist(), pairwise(words), strict=True)
        if now not in (before, "")
    ]
    assert moves.marks() == begun and len(begun) > 2 and moves.figures() == {}


def test_of_several_people_each_mark_says_who():
    scene = load_scene(find_scene("cell-left"), seed=0)
    other = load_scene(find_scene("cell-right"), seed=1)
    (one,), (two,) = walkers(scene), walkers(other)
    plans = [replace(w.plan, name=name) for w, name in ((one, "ann"), (two, "bea"))]
    world = World([b for plan in plans for b in person_bodies(plan)])
    moves = Moves(world)
    for stamp in np.arange(0.0, 30.0, 0.1).tolist():
        world.step(stamp)
        moves.update(SimpleNamespace(stamp=stamp))
    assert {words.partition(" ")[0] for _, words in moves.marks()} == {"ann", "bea"}
