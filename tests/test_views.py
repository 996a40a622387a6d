"""What other viewers are told: readable by plain tools, complete in itself, and in its place."""

import json
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from app.assets import asset_folder
from app.cell.learned import Learned
from app.cell.outline import bottom_of
from app.colours import POINT
from app.messages import BackgroundView, Mode, Notice, Status, Verdict
from app.record.views.clouds import PACKED, TOPICS
from app.record.views.frames import TOOL, base_frame, body_frame
from app.record.views.models import Z_TO_Y
from app.record.views.pair import _turn
from app.record.views.schemas import SCHEMAS, schemas_of
from app.record.views.surface import COUNT, surface_topic
from app.record.views.views import Views
from app.record.views.writer import ViewWriter
from app.timing import ManualClock
from app.wiring import Setup, build_engine
from tests.fakes import cloud_of

AT = 1_790_000_000_123_456_789  # [ns] since 1970


@pytest.fixture(scope="module")
def engine():
    made = build_engine(Setup(scene="cell", seed=1), ManualClock())
    for _ in range(150):
        made.step()
    yield made
    made.close()


@pytest.fixture(scope="module")
def snapshot(engine):
    return engine.snapshots.get()[0]


@pytest.fixture
def views(engine):
    return Views(engine.robot, engine.skin, engine.cell)


def told(views, snapshot, at=AT):
    """Messages of one picture by their topics."""
    return dict(views.of(snapshot, at))


def points_of(message):
    return np.frombuffer(message.data, dtype=PACKED)


def test_a_plain_reader_finds_every_topic_with_its_schema_and_reads_every_message(
    views, engine, snapshot
):
    file, schemas = BytesIO(), schemas_of(engine.robot)
    writer = Writer(file)
    writer.start()
    out = ViewWriter(writer, views)
    for i in range(5):
        out.write(replace(snapshot, stamp=snapshot.stamp + i), AT + i)
    writer.finish()
    file.seek(0)
    seen = {}
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        assert schema.encoding == channel.message_encoding == "protobuf"
        assert schema.name == f"foxglove.{schemas[channel.topic].__name__}"
        mine = schemas[channel.topic]()
        mine.ParseFromString(message.data)
        assert mine.IsInitialized() and mine.SerializeToString() == message.data
        assert decoded.DESCRIPTOR.full_name == schema.name
        assert AT <= message.log_time < AT + 5
        seen.setdefault(channel.topic, []).append(message.sequence)
    assert {"/tf", "/joint_states", "/goal", "/robot", "/cell", "/obstacles"} <= set(seen)
    assert {"/points/kept", "/points/self", "/pair", "/log"} <= set(seen) <= set(schemas)
    assert seen["/robot"] == [0] and seen["/tf"] == [0, 1, 2, 3, 4]


def test_whatever_is_drawn_hangs_on_a_frame_that_is_told(views, engine, snapshot):
    base, out = base_frame(engine.robot), told(views, snapshot)
    placed = {t.child_frame_id: t for t in out["/tf"].transforms}
    assert {t.parent_frame_id for t in placed.values()} == {base}
    assert set(placed) == {*engine.robot.links, TOOL} | {
        body_frame(p.view.name) for p in snapshot.world
    }
    frames = {base, *placed}
    for topic, message in out.items():
        if topic.startswith("/points"):
            assert message.frame_id == base
        for entity in getattr(message, "entities", ()):
            assert entity.frame_id in frames, (topic, entity.id)
            assert entity.frame_locked and not entity.lifetime.ToNanoseconds()
    tool = placed[TOOL].translation
    assert (tool.x, tool.y, tool.z) == tuple(snapshot.T_base_tool[:3, 3])
    assert out["/goal"].timestamp.ToNanoseconds() == AT


def test_a_model_that_its_viewer_has_turned_is_the_mesh_of_its_link(views, engine, snapshot):
    entities = told(views, snapshot)["/robot"].entities
    assert [e.id for e in entities] == list(engine.robot.links)
    upright = np.linalg.inv(Z_TO_Y)  # a quarter of a turn about x, as viewers do it
    assert upright[:3, :3] == pytest.approx(trimesh.transformations.rotation_matrix(
        np.pi / 2, [1, 0, 0])[:3, :3], abs=1e-12)  # fmt: skip
    for entity in entities:
        (model,) = entity.models
        assert model.media_type == "model/gltf-binary" and model.data[:4] == b"glTF"
        assert (model.scale.x, model.scale.y, model.scale.z) == (1.0, 1.0, 1.0)
        scene = trimesh.load_scene(BytesIO(model.data), file_type="glb")
        scene.apply_transform(upright)
        assert scene.bounds == pytest.approx(engine.robot.visual(entity.id).bounds, abs=1e-5)


def test_the_arm_is_told_as_points_of_its_surface_too(views, engine, snapshot):
    out = told(views, snapshot)
    for link, body in zip(engine.robot.links, engine.robot.bodies, strict=True):
        message = out[surface_topic(link)]
        got = points_of(message)
        assert message.frame_id == link and len(got) == COUNT
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        assert (got["xyz"] >= low - 1e-5).all() and (got["xyz"] <= high + 1e-5).all()
        assert got["rgba"][:, 0].std() > 5.0  # shaded
    assert surface_topic(link) not in told(views, snapshot)


def test_every_measured_point_is_in_the_cloud_of_its_verdict_in_its_colour(views, snapshot):
    out, cloud = told(views, snapshot), snapshot.cloud
    measured = np.isfinite(cloud.points[:, 0])
    assert measured.any()
    for verdict, topic in TOPICS.items():
        mine = measured & (cloud.verdict == verdict)
        assert (topic in out) == mine.any()
        if mine.any():
            got = points_of(out[topic])
            assert got["xyz"] == pytest.approx(cloud.points[mine].astype(np.float32))
            assert (got["rgba"] == (*POINT[verdict], 255)).all()
            names = [f.name for f in out[topic].fields]
            assert names == ["x", "y", "z", "red", "green", "blue", "alpha"]
            assert out[topic].point_stride == 16


def test_a_cloud_that_empties_is_told_once_as_empty(views, snapshot):
    here = cloud_of([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    none = replace(here, verdict=np.full(2, Verdict.NO_TARGET, dtype=np.uint8))
    first = told(views, replace(snapshot, cloud=here))["/points/kept"]
    assert len(points_of(first)) == 2
    gone = told(views, replace(snapshot, cloud=none))["/points/kept"]
    assert gone.data == b"" and gone.point_stride == 16
    assert "/points/kept" not in told(views, replace(snapshot, cloud=none))


def test_many_remembered_points_are_thinned(views, snapshot):
    many = np.random.default_rng(0).normal(size=(10_000, 3))
    got = points_of(told(views, replace(snapshot, memory=many))["/points/remembered"])
    assert got["xyz"] == pytest.approx(many[::3].astype(np.float32))


def test_meshes_are_told_once_and_then_only_moved(views, engine, snapshot):
    told(views, snapshot)
    moved = snapshot.world[0].T_base_body.copy()
    moved[0, 3] += 0.5
    world = (replace(snapshot.world[0], T_base_body=moved), *snapshot.world[1:])
    out = told(views, replace(snapshot, world=world))
    assert not {"/robot", "/cell", "/cell/learned", "/obstacles"} & set(out)
    name = body_frame(world[0].view.name)
    (frame,) = (t for t in out["/tf"].transforms if t.child_frame_id == name)
    assert frame.translation.x == moved[0, 3]


def test_a_body_that_goes_is_taken_away_and_the_others_are_told_again(views, engine, snapshot):
    told(views, snapshot)
    out = told(views, replace(snapshot, world=snapshot.world[1:]))["/obstacles"]
    assert [d.type for d in out.deletions] == [1]  # all that were there
    assert [e.id for e in out.entities] == [p.view.name for p in snapshot.world[1:]]


def test_the_ground_lies_below_the_cell_where_nothing_is_simulated(views, engine, snapshot):
    out = told(views, replace(snapshot, world=()))["/cell"]
    ground = next(e for e in out.entities if e.id == "ground")
    assert ground.cubes[0].pose.position.z < min(0.0, bottom_of(engine.cell))
    assert {e.id for e in out.entities} == {
        "ground", *(f"box/{b.name}" for b in engine.cell.boxes),
        *(f"plane/{p.name}" for p in engine.cell.planes),
    }  # fmt: skip


def test_learned_cubes_are_one_mesh_and_go_when_they_are_forgotten(views, snapshot):
    cubes = Learned.of(np.array([[0, 0, 0], [3, 1, 2]])).centres()
    none = np.empty((0, 3))
    known = replace(snapshot, background=BackgroundView(cubes, none))
    (entity,) = told(views, known)["/cell/learned"].entities
    mesh = trimesh.load(BytesIO(entity.models[0].data), file_type="glb", force="mesh")
    assert len(mesh.faces) == 24 and 0.0 < entity.models[0].color.a < 1.0
    assert "/cell/learned" not in told(views, known)
    forgotten = replace(snapshot, background=BackgroundView(none, none))
    gone = told(views, forgotten)["/cell/learned"]
    assert len(gone.deletions) == 1 and not gone.entities


def test_the_pair_is_an_arrow_to_the_robot_with_its_distance(views, engine, snapshot):
    pairs = snapshot.pairs
    assert pairs.closest >= 0
    (entity,) = told(views, snapshot)["/pair"].entities
    (arrow,), (text,) = entity.arrows, entity.texts
    assert text.text.startswith(f"{100 * pairs.minimum:.0f} cm ")
    begin = np.array([getattr(arrow.pose.position, c) for c in "xyz"])
    assert begin == pytest.approx(pairs.on_world[pairs.closest])
    reach = np.linalg.norm(pairs.on_robot[pairs.closest] - begin)
    assert arrow.shaft_length + arrow.head_length == pytest.approx(reach)
    nothing = replace(pairs, closest=-1)
    gone = told(views, replace(snapshot, pairs=nothing))["/pair"]
    assert len(gone.deletions) == 1 and not gone.entities
    assert "/pair" not in told(views, replace(snapshot, pairs=nothing))


@given(st.tuples(*3 * [st.floats(-1, 1)]).filter(lambda v: np.linalg.norm(v) > 1e-3))
def test_an_arrow_turns_the_x_axis_to_where_it_points(way):
    to = np.array(way) / np.linalg.norm(way)
    q = _turn(to)
    T = trimesh.transformations.quaternion_matrix([q["w"], q["x"], q["y"], q["z"]])
    assert T[:3, 0] == pytest.approx(to, abs=1e-5)


def test_the_log_tells_stops_and_answers_once_each(views, snapshot):
    calm = replace(snapshot, status=Status(Mode.RUNNING, "", 0.0), advice="")
    assert [m.message for _, m in views.log(calm, AT)] == ["running"]
    assert views.log(calm, AT) == []
    stopped = replace(
        calm, status=Status(Mode.STOPPED, "ring1-01 is silent", 1.0),
        notice=Notice("the goal is out of reach", refused=True),
    )  # fmt: skip
    levels = [(m.message, m.Level.Name(m.level)) for _, m in views.log(stopped, AT)]
    assert levels == [
        ("stopped: ring1-01 is silent", "ERROR"),
        ("the goal is out of reach", "WARNING"),
    ]
    assert views.log(stopped, AT) == []
    assert "/log" not in told(views, stopped)


def test_a_picture_of_thirty_sensors_is_small(views, snapshot):
    assert snapshot.cloud.stamp.shape == (30,)
    views.of(snapshot, AT)
    size = sum(m.ByteSize() for _, m in views.of(snapshot, AT))
    most = 16 * (1920 + 4096) + 8000  # all zones and a full memory
    assert size < most and size < 40_000


def test_a_robot_whose_link_is_called_base_keeps_its_own_frame(robot):
    assert base_frame(robot) == "base"
    assert base_frame(replace(robot, links=("base", *robot.links[1:]))) == "arm_base"


def test_the_layout_for_viewers_shows_topics_that_there_are():
    layout = json.loads((asset_folder("static_assets") / "viewers" / "layout.json").read_text())
    panels = layout["configById"]
    drawn = {t for t, kind in SCHEMAS.items() if kind.__name__ in ("PointCloud", "SceneUpdate")}
    assert set(panels["3D!flinch"]["topics"]) == drawn | {"/goal"}
    assert panels["RosOut!flinch"]["topicToRender"] == "/log"
    assert {layout["layout"]["first"], layout["layout"]["second"]} == set(panels)
