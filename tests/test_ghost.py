"""The ghost: another controller in the same world that touches nothing."""

import numpy as np
import pytest

from app.config import Params
from app.errors import ConfigError
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine

NEAR = Setup(scene="side-panel", rate=100, seed=3, world="ideal")


def run(setup, seconds, break_at=None):
    engine = build_engine(setup, ManualClock(), Params(mode="sm"))
    while True:
        s = engine.step()
        if break_at is not None and s.stamp > break_at and engine.ghost:
            engine.ghost._brain._perception = None
        if s.stamp >= seconds:
            return engine, s


def test_a_ghost_moves_by_its_own_controller_and_leaves_the_arm_alone():
    _, alone = run(NEAR, 3.5)
    _, both = run(Setup(scene="side-panel", rate=100, seed=3, world="ideal", ghost="wb"), 3.5)
    assert alone.ghost is None and both.ghost.mode == "wb"
    assert np.array_equal(alone.joints.q, both.joints.q)
    assert np.abs(both.ghost.T_base_link - both.T_base_link).max() > 0.05
    assert both.ghost.distance > both.body.minimum + 0.03  # it keeps all of its body clear


def test_a_ghost_that_fails_is_left_out_and_the_arm_goes_on():
    _, s = run(
        Setup(scene="side-panel", rate=100, seed=3, world="ideal", ghost="wb"), 1.5, break_at=1.0
    )
    assert s.ghost is None and s.notice.refused
    assert "the ghost is left out" in s.notice.words and "NoneType" in s.notice.words
    assert s.status.mode == "running" and np.abs(s.joints.qd).max() > 0.0


def test_an_unknown_ghost_is_refused():
    with pytest.raises(ConfigError, match="wb"):
        build_engine(Setup(ghost="casper"), ManualClock())
