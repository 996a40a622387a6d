"""The ring of speed and separation in the scene, on a fake scene."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.config import Params
from app.control.separation import protective_distance
from app.messages import JointState, Pairs
from app.ui.colours import ALARM, GREY
from app.ui.scene.separation_view import SeparationView


def nearest(distance):
    on, n = np.array([[0.4, 0.1, 0.6]]), np.array([[-1.0, 0.0, 0.0]])
    d = np.array([distance])
    return Pairs(np.array([6]), d, on, on - d[:, None] * n, n, np.zeros(1, dtype=np.intp), 0)


def at(params, pairs, qd=0.0):
    joints = JointState(0.0, np.zeros(6), np.full(6, qd))
    return SimpleNamespace(params=params, pairs=pairs, joints=joints)


@pytest.fixture
def view():
    def add_line_segments(name, points, colors, visible):
        return SimpleNamespace(points=points, colors=colors, visible=visible, position=np.zeros(3))

    return SeparationView(
        SimpleNamespace(scene=SimpleNamespace(add_line_segments=add_line_segments))
    )


@pytest.mark.parametrize("used", [Params(separation=True), Params(mode="ssm")])
def test_the_ring_has_the_protective_distance_around_the_nearest_point(view, used):
    view.update(at(Params(), nearest(0.5)))
    assert not view.ring.visible
    view.update(at(used, nearest(0.5)))
    still = float(protective_distance(np.array(0.0), used))
    assert view.ring.visible and view.ring.position == pytest.approx([0.4, 0.1, 0.6])
    radius = np.linalg.norm(view.ring.points[:, 0], axis=1)
    assert radius == pytest.approx(still, rel=1e-5)
    view.update(at(used, nearest(0.5), qd=0.2))
    assert np.linalg.norm(view.ring.points[0, 0]) > still + 0.05  # a faster arm needs more


def test_the_ring_turns_red_when_something_is_inside_it_and_goes_with_the_last_pair(view):
    used = Params(separation=True)
    view.update(at(used, nearest(0.2)))
    assert (np.asarray(view.ring.colors)[0, 0] == ALARM).all()
    view.update(at(used, nearest(1.5)))
    assert (np.asarray(view.ring.colors)[0, 0] == GREY).all()
    none = Pairs(*[np.empty(0)] * 2, *[np.empty((0, 3))] * 3, np.empty(0), -1)
    view.update(at(used, none))
    assert not view.ring.visible
