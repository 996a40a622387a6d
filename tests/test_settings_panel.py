"""The tab of the settings: presets, what counts for whom, back to the default, files."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.actions import Remark, SetParams
from app.brain import Brain
from app.config import Params, load_params, tunables
from app.config_text import toml
from app.control.registry import EVERYONES, kinds, used
from app.errors import ConfigError
from app.setup import Setup
from app.timing import ManualClock
from app.ui.panels.params_panel import (
    ALL,
    FIRST,
    NOTHING,
    PRESETS,
    ParamsPanel,
    changed_names,
    preset_changes,
    preset_of,
    told_html,
)
from app.ui.shelf import Shelf
from app.wiring import build_engine
from tests.ui_page import (  # noqa: F401 - fixtures
    run,
    serving,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)


def test_a_preset_sets_distance_speeds_and_memory_together(page, engine):
    run(page, page.params.preset, "careful")
    (action,) = engine.posted
    assert action == SetParams(preset_changes("careful"))
    careful = replace(Params(), **action.changes)
    assert careful.distance_kept == 0.35 and preset_of(careful) == "careful"
    assert careful.distance_kept > Params().distance_kept > PRESETS["bold"]["distance_kept"]
    assert replace(careful, **preset_changes("normal")) == Params()
    assert preset_of(replace(careful, memory=False)) == ""


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_within_the_ranges(name):
    replace(Params(), **preset_changes(name))


def test_how_many_are_changed_is_told_and_each_goes_back_by_a_press(page, engine):
    some = Params(distance_kept=0.3, silence=0.7, mode="wb")
    show(page, engine, snapshot(engine, params=some))
    assert "<b>2 changed</b>" in page.params.told.content and "(WB)" in page.params.told.content
    assert page.params.back.options == ("Distance kept", "Silence", ALL)
    run(page, page.params.back, "Silence")
    run(page, page.params.back, ALL)
    assert engine.posted == [
        SetParams({"silence": 0.5}), SetParams({"distance_kept": 0.25, "silence": 0.5}),
    ]  # fmt: skip
    show(page, engine, snapshot(engine))
    assert page.params.back.options == (NOTHING,)
    run(page, page.params.back, NOTHING)
    assert len(engine.posted) == 2 and "defaults" in told_html(Params())
    assert changed_names(some) == ["distance_kept", "silence"]


def test_what_the_controller_does_not_use_is_grey(page, engine):
    show(page, engine, snapshot(engine, params=Params(mode="wb")))
    controls = page.params.controls
    assert controls["avoidance_begins"].disabled and not controls["limits_first"].disabled
    show(page, engine, snapshot(engine))
    assert not controls["avoidance_begins"].disabled and controls["limits_first"].disabled
    assert controls["person_speed"].disabled  # the separation is off
    show(page, engine, snapshot(engine, params=Params(separation=True)))
    assert not controls["person_speed"].disabled
    assert not any(controls[name].disabled for name in FIRST)


@pytest.mark.parametrize("mode", ["qp", "ssm", "wb", "sm", "multi", "paper"])
def test_a_setting_that_is_grey_changes_no_command(mode):
    start = Params(mode=mode)
    grey = {t.name for t in tunables()} - used(start)
    assert grey and not grey & (EVERYONES - {"memory", "obstacle_speed"})
    other = replace(start, **{t.name: far(t, start) for t in tunables() if t.name in grey})
    one, two = (commands(p) for p in (start, other))
    assert np.array_equal(one, two) and np.abs(one).max() > 0.01
    assert used(Params(mode=next(iter(kinds())))) < {t.name for t in tunables()}


def far(t, params):
    """Another value of a setting than it has."""
    now = getattr(params, t.name)
    if t.kind is bool:
        return not now
    if t.choices:
        return next(c for c in t.choices if c != now)
    return t.high if now != t.high else t.low


def commands(params):
    """(60, n) joint velocities of an arm that goes towards a plate."""
    engine = build_engine(Setup(scene="front-panel", rate=60.0), ManualClock(), params)
    assert isinstance(engine.brain, Brain)
    return np.array([engine.step().command.qd for _ in range(60)])


def test_saved_settings_are_a_file_that_run_takes_and_the_page_loads(tmp_path, engine):
    shelf, posted = Shelf(tmp_path / "recordings", "settings"), []
    other = SimpleNamespace(post=posted.append)
    with serving(port=0) as server:
        panel = ParamsPanel(server, other, ManualClock(), shelf)
        assert panel.files.options == (NOTHING,)
        panel.update(snapshot(engine, params=Params(distance_kept=0.3, mode="wb", memory=False)))
        panel._try(panel._save)
        (name,) = shelf.names()
        assert panel.files.value == name and "flinch run --params" in posted[-1].words
        params = load_params(shelf.path(name))
        assert (params.distance_kept, params.mode, params.memory) == (0.3, "wb", False)
        panel._try(panel._load)
        assert posted[-1].changes["distance_kept"] == 0.3
        assert len(posted[-1].changes) == len(list(tunables()))
        shelf.path(name).write_text("distance_kept = 9.0\n")
        panel._try(panel._load)
        assert isinstance(posted[-1], Remark) and posted[-1].refused
        assert "give a value from 0.05 to 0.4" in posted[-1].words


def test_no_other_file_is_reached_by_a_name_that_a_page_sends(tmp_path):
    (tmp_path / "secret.toml").write_text("")
    shelf = Shelf(tmp_path / "in", "settings")
    assert shelf.names() == ()
    for name in ("../secret.toml", "/etc/passwd", "settings_x.toml"):
        with pytest.raises(ConfigError, match="none of the saved files"):
            shelf.path(name)


def test_a_file_of_settings_says_what_each_is():
    text = "\n".join(toml(Params(mode="wb")))
    assert 'mode = "wb"' in text and "memory = true" in text and "distance_kept = 0.25" in text
