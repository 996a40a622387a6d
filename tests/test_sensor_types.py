"""Sensor types are data: a 16x16 radial one and one of a single zone, from TOML to the cloud.

The judge has its own geometry: where a zone looks comes from the angles in `tests.mixed_skin`,
what it should see from planes and lines.
"""

from math import radians, tan

import numpy as np
import pytest

from app.actions import AddObstacle
from app.cell.parts import Cell
from app.errors import RobotError
from app.messages import Mode, Verdict
from app.perception.cloud import SkinCloud
from app.perception.flow import no_frames, renew_frames
from app.perception.memory import Memory
from app.perception.rules import Rules
from app.robot.sensor_type import load_sensor_type
from app.robot.skin_file import load_skin
from app.sensing.error_model import ErrorModel
from app.sensing.open_ports import open_skin
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.sensing.simulated import SimulatedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.wire import binary
from app.sensing.wire.detect import FORMATS
from app.setup import Setup
from app.timing import ManualClock, WallClock
from app.virtual.skin.emulate import raw_frame
from app.virtual.skin.pty_port import PtyPort
from app.wiring import build_engine
from app.world.world import World
from tests import mixed_skin
from tests.mixed_skin import LENS, NOISE, SHAPES, SHIFT
from tests.ports import HandPort, raw

P = Rules(doubts_ghosts=False)


@pytest.fixture(scope="module")
def layout(tmp_path_factory):
    return mixed_skin.write(tmp_path_factory.mktemp("skin"))


@pytest.fixture(scope="module")
def mixed(robot, layout):
    return load_skin(layout, robot)


def looks(name):
    """(n, 3) unit directions of a sensor's zones: x right, y down, z out, as it looks out."""
    rows, columns, across, down = SHAPES[name]
    out = []
    for r in range(rows):
        for c in range(columns):
            x = tan(radians((c + 0.5) / columns * across - across / 2))
            y = tan(radians((r + 0.5) / rows * down - down / 2))
            out.append(np.array([x, y, 1.0]) / np.linalg.norm([x, y, 1.0]))
    return np.array(out)


def lens_and_axes(robot, posture, name):
    """Base frame: lens and the columns x right, y down, z out; up is the forearm's +x, out +y."""
    T = posture.T_base_link[robot.link_index("forearm_link")]
    lens = T[:3, :3] @ np.add(LENS, [SHIFT[name], 0.0, 0.0]) + T[:3, 3]
    z, down = T[:3, 1], -T[:3, 0]
    return lens, np.stack([np.cross(down, z), down, z], axis=1)


def wall_before(robot, posture, distance, tilt_deg):
    """A world with a large board before the sensors, and the plane of its face: point, normal."""
    T, turn = np.eye(4), np.eye(4)
    T[:3, 3], T[:3, :3] = lens_and_axes(robot, posture, "eight")
    c, s = np.cos(radians(tilt_deg)), np.sin(radians(tilt_deg))
    turn[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    turn[2, 3] = distance
    board = T @ turn
    world = World(())
    world.add("board", {"kind": "box", "size_m": [3.0, 3.0, 0.02]}, (0, 0, 0))
    world.move("board", board)
    normal = board[:3, 2]
    return world, board[:3, 3] - 0.01 * normal, normal


def true_points(robot, posture, name, on_plane, normal):
    """(n, 3) where the middle of each zone meets the plane."""
    lens, axes = lens_and_axes(robot, posture, name)
    rays = looks(name) @ axes.T
    length = ((on_plane - lens) @ normal) / (rays @ normal)
    return lens + length[:, None] * rays, length


# --- what a type is -----------------------------------------------------------------------


def test_each_sensor_of_a_mixed_skin_has_as_many_slots_as_zones(mixed):
    assert mixed.first.tolist() == [0, 64, 64 + 256, 64 + 256 + 1]
    assert mixed.slots == 321 and mixed.zones(1) == slice(64, 320)
    assert np.bincount(mixed.sensor_of).tolist() == [64, 256, 1]


def test_a_zones_report_leads_to_the_point_on_its_own_ray(robot, mixed):
    for k, sensor in enumerate(mixed.sensors):
        R = sensor.T_link_sensor[:3, :3]
        rays = looks(sensor.name) @ R.T
        scale = np.ones(len(rays)) if sensor.name == "wide" else 1.0 / looks(sensor.name)[:, 2]
        np.testing.assert_allclose(mixed.reach[mixed.zones(k)], rays * scale[:, None], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "zones", "view"),
    [("vl53l8cx", 64, 45.0), ("vl53l8cx-4x4", 16, 45.0), ("vl53l5cx", 64, 45.0),
     ("vl53l7cx", 64, 60.0), ("vl53l1x", 1, 19.3)],
)  # fmt: skip
def test_the_types_that_ship_can_be_named(name, zones, view):
    kind = load_sensor_type(name)
    assert kind.zones == zones and kind.field_of_view_deg == (view, view)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rows = 16", "rows = 0", r"wide\.toml: rows = 0; give a whole number from 1 up to 32"),
        ("rows = 16", "row = 16", r"unknown key 'row'; did you mean 'rows'"),
        ('"radial"', '"round"', r"range = 'round'.*perpendicular.*radial"),
        ("footprint = 1", "footprint = 2", r"footprint = 2; .*1.*3.*5.*7"),
        ("least_m = 0.03", "least_m = 9.0", r"least_m = 9 is not below most_m = 3; lower it"),
        ("trusted = [1, 2]", "trusted = [0, 1]", r"trusted holds no_target = 0; leave it out"),
        ("valid = 1\n", "", r"status: key 'valid' is missing; add it"),
        ("title", "titel", r"unknown key 'titel'; did you mean 'title'"),
    ],
)
def test_a_broken_type_is_named_with_file_key_and_remedy(robot, layout, tmp_path, old, new, says):
    mixed_skin.write(tmp_path)
    (tmp_path / "wide.toml").write_text(mixed_skin.WIDE.replace(old, new, 1))
    with pytest.raises(RobotError, match=says) as error:
        load_skin(tmp_path / "mixed.toml", robot)
    assert "mixed.toml: type = 'wide.toml': " in str(error.value) and "\n" not in str(error.value)


def test_an_unknown_type_is_told_with_the_known_ones(robot, tmp_path):
    file = mixed_skin.write(tmp_path)
    file.write_text(file.read_text().replace('"vl53l8cx"', '"vl53l8"'))
    with pytest.raises(RobotError, match=r"'vl53l8' is neither .*did you mean 'vl53l8cx.*vl53l1x"):
        load_skin(file, robot)


# --- from the world to the cloud ----------------------------------------------------------


def test_every_type_sees_a_tilted_board_where_it_is(robot, mixed):
    posture = robot.posture(robot.home)
    world, on_plane, normal = wall_before(robot, posture, 0.6, 20.0)
    eye = SimulatedSkin(robot, mixed, world, 1, ErrorModel(bias=0.0, rejected=0.0), latency=0.0)
    cloud = SkinCloud(robot, mixed, Cell())
    for i in range(4):
        cloud.add_frames(eye.poll(i / 15, posture), posture, P)
    view = cloud.view(3 / 15)
    for k, sensor in enumerate(mixed.sensors):
        mine = mixed.zones(k)
        points, kept = view.points[mine], view.verdict[mine] == Verdict.KEPT
        assert kept.mean() > 0.9, sensor.name
        true, length = true_points(robot, posture, sensor.name, on_plane, normal)
        floor, share = NOISE[sensor.name]
        off = np.linalg.norm(points - true, axis=1)[kept]
        sigma = np.maximum(floor, share * length)[kept]
        # five sigmas of the noise, and half a millimetre of the report's rounding and the mean
        # over a zone of a board that is not square to it
        assert (off < 5.0 * sigma + 0.004).all(), (sensor.name, off.max())


def test_the_robots_own_body_is_recognised_by_every_type(robot, mixed):
    eye = SimulatedSkin(robot, mixed, World(()), 2, ErrorModel(), latency=0.0)
    rng, seen, passed = np.random.default_rng(3), 0, 0
    for i in range(60):
        posture = robot.posture(rng.uniform(-2.6, 2.6, robot.n))
        cloud = SkinCloud(robot, mixed, Cell())
        cloud.add_frames(eye.poll(i / 10, posture), posture, P)
        verdict = cloud.view(i / 10).verdict
        seen += int((verdict == Verdict.SELF).sum())
        passed += int((verdict == Verdict.KEPT).sum())
    assert seen > 500 and passed < 0.02 * seen


def test_only_zones_with_neighbours_on_both_axes_have_a_surface(robot, mixed):
    posture = robot.posture(robot.home)
    world, _, normal = wall_before(robot, posture, 0.5, 10.0)
    eye = SimulatedSkin(robot, mixed, world, 1, ErrorModel(ideal=True), latency=0.0)
    cloud = SkinCloud(robot, mixed, Cell())
    cloud.add_frames(eye.poll(0.0, posture) + eye.poll(1 / 15, posture), posture, P)
    frames, now = no_frames(mixed.first, mixed.grid), cloud.newest()
    renew_frames(np.arange(3), now.points, now.verdict, now.stamp, frames)
    wide = frames.normals[mixed.zones(1)]
    known = np.isfinite(wide[:, 0])
    assert known.mean() > 0.9 and (np.abs(wide[known] @ normal) > 0.97).all()
    assert np.isnan(frames.normals[mixed.zones(2)]).all()


def test_the_memory_forgets_what_a_wide_view_looks_through(robot, mixed):
    posture = robot.posture(robot.home)
    world, _, _ = wall_before(robot, posture, 0.4, 0.0)
    eye = SimulatedSkin(robot, mixed, world, 1, ErrorModel(ideal=True), latency=0.0)
    cloud, memory = SkinCloud(robot, mixed, Cell()), Memory(robot, mixed)

    def look(times, begin):
        for i in range(times):
            now = begin + i / 20
            frames = [f for f in eye.poll(now, posture) if f.sensor == 1]
            cloud.add_frames(frames, posture, P)
            if frames:
                memory.update(cloud.newest(), np.array([1]), posture)
        return int(memory.use.sum())

    seen = look(10, 0.0)
    assert seen > 50
    world.move("board", np.array([[1, 0, 0, 9], [0, 1, 0, 9], [0, 0, 1, 9], [0, 0, 0, 1.0]]))
    world.add("far", {"kind": "sphere", "radius_m": 0.01}, (9.0, 9.0, 9.0))
    assert look(20, 1.0) < 0.1 * seen


def test_a_controller_gives_way_to_what_a_mixed_skin_sees(robot, layout):
    engine = build_engine(Setup(skin=str(layout), scene="empty", seed=1), ManualClock())
    lens, axes = lens_and_axes(robot, robot.posture(robot.home), "wide")
    centre, radius = lens + 0.28 * axes[:, 2], 0.08
    engine.post(AddObstacle("Ball", {"kind": "sphere", "radius_m": radius}, tuple(centre)))
    seen = np.zeros(3, dtype=int)
    for _ in range(300):
        snapshot = engine.step()
        kept = snapshot.cloud.verdict == Verdict.KEPT
        off = np.linalg.norm(snapshot.cloud.points[kept] - centre, axis=1) - radius
        # the ball's rim is seen at a slant: a zone's mean lies a little behind it
        assert (np.abs(off) < 0.03).all()
        seen += np.bincount(engine.skin.sensor_of[kept], minlength=3)
    assert snapshot.status.mode is Mode.RUNNING and (seen > 100).all()
    T = snapshot.T_base_link[robot.link_index("forearm_link")]
    after = T[:3, :3] @ np.add(LENS, [SHIFT["wide"], 0.0, 0.0]) + T[:3, 3]
    # without a cover in this layout the body itself lies 17 mm behind the lens
    assert np.linalg.norm(after - centre) > np.linalg.norm(lens - centre) + 0.013


def test_frames_from_a_process_of_their_own_are_the_same_whatever_their_size(robot, mixed):
    def frames(kind):
        world, _, _ = wall_before(robot, robot.posture(robot.home), 0.6, 20.0)
        eye, posture = kind(robot, mixed, world, 5), robot.posture(robot.home)
        if kind is SimulatedSkinApart:
            eye.wait()
        out, now = [], 0.0
        try:
            while len(out) < 12:
                out += eye.poll(now, posture)
                while kind is SimulatedSkinApart and eye.unanswered:
                    pass
                now += 0.004
        finally:
            eye.close()
        return out[:12]

    for a, b in zip(frames(SimulatedSkin), frames(SimulatedSkinApart), strict=True):
        assert (a.sensor, a.sequence) == (b.sensor, b.sequence)
        assert np.array_equal(a.distance, b.distance) and np.array_equal(a.status, b.status)


# --- over the wire ------------------------------------------------------------------------


def said(robot, mixed):
    """A simulated frame of each sensor."""
    posture = robot.posture(robot.home)
    world, _, _ = wall_before(robot, posture, 0.6, 20.0)
    eye = SimulatedSkin(robot, mixed, world, 3, latency=0.0)
    newest = {f.sensor: f for i in range(30) for f in eye.poll(i / 250, posture)}
    return [newest[k] for k in range(3)]


def test_every_type_goes_over_the_binary_wire_as_it_is(robot, mixed):
    port = HandPort("/dev/hand", "binary")
    source = SerialSkin(mixed, [port], [PortSpec("/dev/hand")])
    posture, sent = robot.posture(robot.home), said(robot, mixed)
    source.poll(0.0, posture)
    for f in sent:
        port.say(raw_frame(f, mixed.sensors[f.sensor].type.grid, 1000), 0.01)
    got = source.poll(0.02, posture)
    assert [f.sensor for f in got] == [0, 1, 2]
    for a, b in zip(sent, got, strict=True):
        seen = a.targets > 0
        assert len(b.distance) == mixed.sensors[a.sensor].type.zones
        assert np.array_equal(a.targets, b.targets)
        assert np.allclose(a.distance[seen], b.distance[seen], atol=1e-9)
        assert np.array_equal(a.status[seen], b.status[seen])


def test_a_mixed_skin_speaks_through_a_pseudo_terminal(robot, mixed, tmp_path):
    link, posture, clock = tmp_path / "skin", robot.posture(robot.home), WallClock()
    sent, got, end = said(robot, mixed), {}, clock.now() + 5.0
    with PtyPort(link) as port:
        source = open_skin(str(link), mixed, clock)
        try:
            while len(got) < 3 and clock.now() < end:
                for f in sent:
                    port.write(binary.encode(raw_frame(f, mixed.sensors[f.sensor].type.grid, 7)))
                clock.sleep_until(clock.now() + 0.02)
                got |= {f.sensor: f for f in source.poll(clock.now(), posture)}
            words = dict(source.inputs(clock.now()))[str(link)]
        finally:
            source.close()
    assert sorted(got) == [0, 1, 2] and "3 sensors" in words and "binary" in words
    for f in sent:
        seen = f.targets > 0
        assert np.allclose(got[f.sensor].distance[seen], f.distance[seen], atol=1e-9)


def test_eight_by_eight_frames_stay_as_they_were_on_the_wire_and_others_have_their_own(
    robot, mixed
):
    grids = [sensor.type.grid for sensor in mixed.sensors]
    packets = [binary.encode(raw_frame(f, grids[f.sensor], 1000)) for f in said(robot, mixed)]
    assert [len(p) for p in packets] == [210, 14 + 3 * 256 + 4 + 4 + 1, 14 + 3 + 4 + 1 + 1]


@pytest.mark.parametrize("name", ["f", "table", "table-plain", "lines", "lines-plain"])
@pytest.mark.parametrize("k", [0, 1, 2])
def test_text_formats_carry_the_grid_of_the_sensor_on_their_port(robot, mixed, name, k):
    sensor, style = mixed.sensors[k], FORMATS[name]
    (spec,) = parse_ports(f"/dev/hand={sensor.name}", mixed)
    raw = raw_frame(said(robot, mixed)[k], sensor.type.grid, 1000)
    decoder = style.decoder(spec.grids)
    (frame,) = decoder.feed(b"\n" + style.encode(raw) + b"\n")
    assert frame.grid == sensor.type.grid
    seen = frame.status != 255
    assert np.array_equal(frame.distance[seen], raw.distance[seen])


def test_bare_numbers_get_the_statuses_of_their_sensors_type(robot, mixed):
    port = HandPort("/dev/hand", "lines", ((16, 16),))
    source = SerialSkin(mixed, [port], [PortSpec("/dev/hand", sensors=(1,))])
    posture = robot.posture(robot.home)
    source.poll(0.0, posture)
    numbers = np.arange(256) * 20  # up to 5.1 m
    port.hear(b"\n" + ",".join(map(str, numbers)).encode() + b"\n", 0.01)
    (frame,) = source.poll(0.02, posture)
    valid = frame.status == 1
    assert valid.sum() == ((numbers > 0) & (numbers < 3000)).sum()
    assert (frame.status[~valid] == 0).all() and np.array_equal(frame.targets > 0, valid)


@pytest.mark.parametrize("wrong", [(8, 8), (1, 1), (16, 15)])
def test_a_frame_of_the_wrong_size_for_its_sensor_is_refused_with_a_reason(robot, mixed, wrong):
    port = HandPort()
    source = SerialSkin(mixed, [port], [PortSpec("/dev/hand")])
    posture = robot.posture(robot.home)
    source.poll(0.0, posture)
    port.say(raw(sensor=1, grid=wrong), 0.01)
    assert source.poll(0.02, posture) == []
    rows, columns = wrong
    says = f"wide reports {rows}x{columns} zones, the layout has 16x16"
    assert says in source.fault(0.02, 0.5, np.ones(3, dtype=bool))
