"""The ring of speed and separation in the scene, on a fake scene."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.messages import Command, Pairs
from app.ui.colours import ALARM, GREY
from app.ui.scene.separation_view import SeparationView


def nearest(distance):
    on, n = np.array([[0.4, 0.1, 0.6]]), np.array([[-1.0, 0.0, 0.0]])
    d = np.array([distance])
    return Pairs(np.array([6]), d, on, on - d[:, None] * n, n, np.zeros(1, dtype=np.intp), 0)


def at(protective, pairs):
    return SimpleNamespace(pairs=pairs, command=Command(np.zeros(6), protective=protective))


@pytest.fixture
def view():
    def add_line_segments(name, points, colors, visible):
        return SimpleNamespace(points=points, colors=colors, visible=visible, position=np.zeros(3))

    return SeparationView(
        SimpleNamespace(scene=SimpleNamespace(add_line_segments=add_line_segments))
    )


def test_the_ring_has_the_protective_distance_around_the_nearest_point(view):
    view.update(at(0.0, nearest(0.5)))
    assert not view.ring.visible
    view.update(at(0.37, nearest(0.5)))
    assert view.ring.visible and view.ring.position == pytest.approx([0.4, 0.1, 0.6])
    radius = np.linalg.norm(view.ring.points[:, 0], axis=1)
    assert radius == pytest.approx(0.37, rel=1e-5)


def test_the_ring_turns_red_when_something_is_inside_it_and_goes_with_the_last_pair(view):
    view.update(at(0.37, nearest(0.2)))
    assert (np.asarray(view.ring.colors)[0, 0] == ALARM).all()
    view.update(at(0.37, nearest(1.5)))
    assert (np.asarray(view.ring.colors)[0, 0] == GREY).all()
    none = Pairs(*[np.empty(0)] * 2, *[np.empty((0, 3))] * 3, np.empty(0), -1)
    view.update(at(0.0, none))
    assert not view.ring.visible
