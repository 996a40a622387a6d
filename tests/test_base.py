"""The ground floor: settings, time, files and error messages."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.assets import asset_folder, find_asset
from app.config import Params, change, load_params, tunables
from app.config_names import CONSTANT, ELSEWHERE, NOW
from app.errors import ConfigError, options
from app.messages import freeze
from app.raycast import MISS, Beams, RigidMesh, Solids, no_hits
from app.timing import Latest, ManualClock, Stopwatch, Ticker


def test_every_setting_is_checked_at_both_ends_of_its_range():
    for t in tunables():
        if t.low is None:
            continue
        assert getattr(Params(**{t.name: t.low}), t.name) == t.low
        for bad in (t.low - 1.0, t.high + 1.0, math.nan, math.inf):
            with pytest.raises(ConfigError, match=t.name):
                Params(**{t.name: bad})


def test_a_setting_of_the_wrong_kind_is_refused():
    for wrong in ({"distance_kept": "0.2"}, {"distance_kept": True}, {"memory": 1}, {"mode": "xx"}):
        with pytest.raises(ConfigError):
            Params(**wrong)


def test_changing_settings_leaves_the_old_ones_alone():
    before = Params()
    assert change(before, {"distance_kept": 0.3}).distance_kept == 0.3
    assert before.distance_kept == 0.25
    with pytest.raises(ConfigError, match="did you mean 'distance_kept'"):
        change(before, {"distance_kpet": 0.3})


def test_a_settings_file_is_read_and_its_faults_are_named(tmp_path):
    file = tmp_path / "s.toml"
    file.write_text("distance_kept = 0.3\nmemory = false\n")
    assert load_params(file).distance_kept == 0.3 and not load_params(file).memory
    file.write_text("distance_kept = 5.0\n")
    with pytest.raises(ConfigError, match=r"s\.toml: distance_kept = 5 m; give a value from 0.05"):
        load_params(file)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_params(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("old", "remedy"),
    [("d_s", "it is called distance_kept now"), ("ssm_person", "it is called person_speed now"),
     ("d_min", "give distance_kept, which is 0.05 m more"), ("k_b", "a constant of the method"),
     ("range_max", "a fact of the sensor's type"), ("two_sided", "choose mode = 'paper'")],
)  # fmt: skip
def test_a_name_of_before_says_what_to_write_instead(tmp_path, old, remedy):
    file = tmp_path / "s.toml"
    file.write_text(f"{old} = 0.25\n")
    with pytest.raises(ConfigError, match=rf"s\.toml: unknown setting '{old}'; .*{remedy}"):
        load_params(file)
    with pytest.raises(ConfigError, match=remedy):
        change(Params(), {old: 0.25})


def test_no_name_of_before_is_a_setting_and_each_new_one_is():
    names = {t.name for t in tunables()}
    assert not names & (NOW.keys() | ELSEWHERE.keys() | CONSTANT)
    assert set(NOW.values()) <= names


def test_about_twenty_settings_are_left_each_in_words():
    assert len(list(tunables())) <= 24
    for t in tunables():
        assert re.fullmatch(r"[a-z]+(_[a-z]+)*", t.name) and len(t.about) > 8
        assert t.label.lower().replace(" ", "_") == t.name


def test_options_put_the_likely_name_first():
    assert options("tabel", ["table", "door"]) == "did you mean 'table'? known: door, table"
    assert options("x", []) == "none is known here"


def test_a_ticker_keeps_its_pace_and_counts_what_it_missed():
    clock = ManualClock()
    ticker = Ticker(clock, 0.01)
    assert [ticker.wait() for _ in range(3)] == [0.0, 0.0, 0.0]
    assert clock.now() == pytest.approx(0.02)
    clock.t += 0.1  # a stall
    assert ticker.wait() == pytest.approx(0.09)
    assert ticker.missed == 1
    assert ticker.wait() == 0.0 and clock.now() == pytest.approx(0.13)  # no burst afterwards


def test_the_mailbox_keeps_the_newest_value_and_its_stamp():
    box = Latest()
    assert box.get() == (None, 0.0)
    box.put("a", 1.0)
    box.put("b", 2.0)
    assert box.get() == box.get() == ("b", 2.0)


def test_a_stopwatch_adds_up_laps_of_the_same_name():
    watch = Stopwatch()
    watch.lap("a")
    first = watch.laps["a"]
    watch.lap("a")
    assert watch.laps["a"] >= first >= 0.0


def test_assets_are_found_by_name_or_path(tmp_path):
    folder = asset_folder("robots")
    assert find_asset("ur10e", folder, "", ConfigError) == folder / "ur10e"
    assert find_asset(str(tmp_path), folder, "", ConfigError) == tmp_path
    with pytest.raises(ConfigError, match="install it again"):
        asset_folder("nothing")


def test_a_frozen_array_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        freeze(np.zeros(3))[0] = 1.0


def test_a_mesh_without_faces_cannot_be_hit():
    with pytest.raises(ValueError, match="without faces"):
        RigidMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


@given(st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1))
def test_rays_hit_a_moved_triangle_where_it_is(angle, y, z):
    triangle = np.array([[0.0, -9, -9], [0, 9, -9], [0, 0, 18]])
    mesh = RigidMesh(triangle, np.array([[0, 1, 2]]))
    T = np.eye(4)
    c, s = math.cos(angle), math.sin(angle)
    T[:2, :2], T[:3, 3] = [[c, -s], [s, c]], [c * 2.0, s * 2.0, 0.0]
    origin = np.array([[-s * y, c * y, z]])  # beside the axis, in the plane through the base
    direction = np.array([[c, s, 0.0]])
    hits = no_hits(np.full(1, MISS), -2)
    solids = Solids([mesh], np.array([7], dtype=np.int16))
    beams = Beams(origin, direction, np.zeros(1), np.array([0, 1]), direction)
    solids.end_rays(T[None], beams, np.zeros((1, 1), dtype=bool), hits)
    assert hits.length[0] == pytest.approx(2.0, abs=1e-5) and hits.label[0] == 7
