"""People who move as a motion file says: read, told apart, scaled, placed and played for ever."""

from pathlib import Path

import numpy as np
import pytest

from app.errors import WorldError
from app.setup import Setup
from app.world.build import FLOOR, PARTS
from app.world.bvh import load_bvh
from app.world.clip import SEAM, Clip
from app.world.people import ELSEWHERE, people_instead
from app.world.scene import load_scene
from app.world.tables import PersonTable, StopTable
from app.world.world import World

MIXAMO = {
    "hips": "mixamorig:Hips", "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toe": "ToeBase",
    "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "left": "mixamorig:Left",
    "right": "mixamorig:Right", "spine": "mixamorig:Spine", "head": "mixamorig:Head",
}  # fmt: skip
CMU = MIXAMO | {
    "hips": "Hips", "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "toe": "Toe",
    "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "left": "Left", "right": "Right",
    "spine": "Chest", "head": "Head",
}  # fmt: skip
STRANGE = CMU | {"left": "Bone", "right": "Knochen", "head": "Kopf"}


def chain(bones, axes: str, scale: float, depth: int = 1) -> list[str]:
    """Lines of a joint and all below it; a bone: name, offset (ahead, left, up) and its own."""
    name, offset, below = bones
    ahead, left, up = (scale * x for x in offset)
    # y-up files look along z, with their left at x
    at = (left, up, ahead) if axes == "y" else (ahead, left, up)
    where = " ".join(f"{x:g}" for x in at)
    lines = [f"{'JOINT' if depth > 1 else 'ROOT'} {name}", "{", f"OFFSET {where}"]
    moves = "6 Xposition Yposition Zposition" if depth == 1 else "3"
    lines.append(f"CHANNELS {moves} Zrotation Xrotation Yrotation")
    for one in below:
        lines += chain(one, axes, scale, depth + 1)
    if not below:
        lines += ["End Site", "{", "OFFSET 0 0 0", "}"]
    return [*lines, "}"]


def person(names: dict[str, str]):
    """The bones of somebody of 1.75 m who stands with level arms."""

    def side(s: str, y: float):
        n = {k: names[s] + v for k, v in names.items()}
        leg = (n["knee"], (0, 0, -0.43), [(n["ankle"], (0, 0, -0.43), [(n["toe"], (0.12, 0, -0.03),
               [])])])  # fmt: skip
        arm = (n["elbow"], (0, 0.325 * y, 0), [(n["wrist"], (0, 0.255 * y, 0), [])])
        return (n["hip"], (0, 0.1 * y, 0), [leg]), (n["shoulder"], (0, 0.22 * y, 0.22), [arm])

    (left_leg, left_arm), (right_leg, right_arm) = side("left", 1), side("right", -1)
    head = (names["head"], (0, 0, 0.31), [])
    spine = (names["spine"], (0, 0, 0.285), [head, left_arm, right_arm])
    return (names["hips"], (0, 0, 0), [left_leg, right_leg, spine])


def write(path: Path, names=CMU, axes="z", scale=1.0, frames=9, step=0.1, turn=20.0) -> Path:
    """Who walks `step` metres ahead a frame of 0.1 s, and turns the last joint's arm."""
    lines = chain(person(names), axes, scale)
    channels = sum(int(line.split()[1]) for line in lines if line.startswith("CHANNELS"))
    rows = []
    for f in range(frames):
        ahead, up = scale * step * f, 0.9 * scale
        moved = (0.0, up, ahead) if axes == "y" else (ahead, 0.0, up)
        rest = np.zeros(channels - 3)
        rest[-1] = turn * f / frames
        rows.append(" ".join(f"{x:g}" for x in (*moved, *rest)))
    head = ["HIERARCHY", *lines, "MOTION", f"Frames: {frames}", "Frame Time: 0.1"]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def clip(path: Path, stature=1.75, at=(1.0, 2.0), heading=0.0) -> Clip:
    return Clip(path, stature, np.array(at), heading, 0.0)


@pytest.mark.parametrize("names", [CMU, MIXAMO])
@pytest.mark.parametrize(("axes", "scale"), [("z", 1.0), ("y", 100.0)])
def test_names_axes_and_units_of_any_kind_give_the_same_person(names, axes, scale, tmp_path):
    plain = clip(write(tmp_path / "plain.bvh"))
    other = clip(write(tmp_path / "other.bvh", names, axes, scale))
    assert set(other.names) == set(PARTS)
    for t in (0.0, 0.33, 1.0):
        np.testing.assert_allclose(other.ends(t), plain.ends(t), atol=1e-4)


@pytest.mark.parametrize("stature", [1.55, 1.95])
def test_a_clip_is_scaled_to_a_stature_and_stands_on_the_floor(stature, tmp_path):
    played = clip(write(tmp_path / "a.bvh", scale=3.0), stature)
    z = played.ends(0.2)[:, :, 2]
    assert (z - played.radius[:, None]).min() == pytest.approx(FLOOR, abs=1e-6)
    assert (z + played.radius[:, None]).max() - FLOOR == pytest.approx(stature, rel=0.03)


def test_a_clip_begins_at_its_place_and_looks_to_its_heading(tmp_path):
    path = write(tmp_path / "a.bvh")
    for heading in (0.0, 90.0, -135.0):
        played = clip(path, heading=np.radians(heading))
        pelvis = played.ends(0.0)[0].mean(axis=0)
        assert pelvis[:2] == pytest.approx([1.0, 2.0], abs=1e-9)
        way = played.ends(0.4)[0].mean(axis=0)[:2] - pelvis[:2]
        assert np.degrees(np.arctan2(way[1], way[0])) == pytest.approx(heading, abs=1e-6)
        left = played.ends(0.0)[played.names.index("left thigh"), 0, :2] - pelvis[:2]
        assert way[0] * left[1] - way[1] * left[0] > 0.0


@pytest.mark.parametrize("step", [0.1, 0.0])
def test_a_clip_is_played_for_ever_without_a_jump(step, tmp_path):
    played = clip(write(tmp_path / "a.bvh", step=step))
    assert played.period == pytest.approx((0.8 + SEAM) * (2 if step else 1))
    t = np.arange(0.0, 2.1 * played.period, 0.01)
    at = np.array([played.ends(float(x)) for x in t])
    assert np.linalg.norm(np.diff(at, axis=0), axis=-1).max() < 4.0 * 0.01
    np.testing.assert_allclose(played.ends(0.3 + played.period), played.ends(0.3), atol=1e-9)
    if step:  # out, round, and back
        out, back = at[80, 0].mean(axis=0), at[200 + 80, 0].mean(axis=0)
        assert out[0] == pytest.approx(1.8, abs=0.02) and back[0] == pytest.approx(1.0, abs=0.02)


def test_bones_of_unknown_names_are_one_capsule_each(tmp_path):
    played = clip(write(tmp_path / "a.bvh", STRANGE, scale=40.0))
    assert len(played.names) == 16 and "Hips to BoneHip 1" in played.names
    z = played.ends(0.0)[:, :, 2]
    assert 1.4 < np.ptp(z) < 1.8 and (z - played.radius[:, None]).min() == pytest.approx(FLOOR)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("HIERARCHY", "<html>", ["line 1", "'<html>' where HIERARCHY belongs", "as BVH"]),
        ("Zrotation", "Wrotation", ["line 5", "unknown channel 'Wrotation'; known: Xposition"]),
        ("OFFSET 0 0 0", "OFFSET 0 x 0", ["line 4", "'x' for an offset; give a number"]),
        ("Frames: 9", "Frames: 12", ["Frames says 12, but 9 follow", "export"]),
        ("Frames: 9", "Frames: -1", ["-1 frames", "whole number"]),
        ("Frame Time: 0.1", "Frame Time: nan", ["finite number"]),
        ("MOTION", "", ["'Frames:' where MOTION belongs"]),
    ],
)
def test_a_file_that_is_wrong_is_told_with_its_line_and_the_remedy(old, new, told, tmp_path):
    path = write(tmp_path / "a.bvh")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(WorldError) as e:
        load_bvh(path)
    for part in ["a.bvh", *told]:
        assert part in str(e.value)
    assert "\n" not in str(e.value)


def test_a_torn_file_and_a_frame_with_too_little_are_told(tmp_path):
    path = write(tmp_path / "a.bvh")
    whole = path.read_text()
    path.write_text(whole.rstrip()[:-20])
    with pytest.raises(WorldError, match=r"line \d+: .* values for \d+ channels"):
        load_bvh(path)
    path.write_text(whole[:300])
    with pytest.raises(WorldError, match=r"the file ends, .* is missing"):
        load_bvh(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(WorldError, match=r"is UTF-16 text.*give another file"):
        load_bvh(path)
    with pytest.raises(WorldError, match=r"none\.bvh: cannot be read"):
        load_bvh(tmp_path / "none.bvh")


def test_a_scene_names_a_clip_and_says_what_is_missing(tmp_path):
    write(tmp_path / "walk.bvh")
    scene = tmp_path / "s.toml"
    ann = 'title = "t"\n[[person]]\nname = "ann"\nclip = "walk.bvh"\n'
    scene.write_text(ann + "at_m = [1, 2]\nstature_m = 1.6\nseed = 4")
    world = World(load_scene(scene).bodies)
    assert len(world.poses()) == 17 and world.poses()[0].view.name == "ann/pelvis"
    again = World(load_scene(scene, seed=5).bodies)  # another beginning
    assert not np.array_equal(world.poses()[0].T_base_body, again.poses()[0].T_base_body)
    scene.write_text(ann)
    with pytest.raises(WorldError, match="person 'ann': a clip is played at one place; give at_m"):
        load_scene(scene)
    scene.write_text(ann.replace("clip", "#") + "at_m = [1, 2]")
    with pytest.raises(WorldError, match="at_m belongs to a clip"):
        load_scene(scene)
    scene.write_text(ann.replace("clip", "#"))
    with pytest.raises(WorldError, match="nowhere to go; give stops or a clip"):
        load_scene(scene)


def test_the_command_line_says_who_is_there():
    stops = (StopTable((0.0, 1.0)), StopTable((0.0, 3.0)))
    people = (PersonTable("ann", stops=stops), PersonTable("bea", stops=stops))
    assert people_instead(people, "") == people and people_instead(people, "none") == ()
    (one,) = people_instead(people, "bvh:a.bvh")
    assert one.at_m == (0.0, 1.0) and one.heading_deg == pytest.approx(90.0)
    (one,) = people_instead(people, "bvh:a.bvh@0.5,-1,30")
    assert one.at_m == (0.5, -1.0) and one.heading_deg == 30.0 and Path(one.clip).is_absolute()
    assert people_instead((), "bvh:a.bvh")[0].at_m == ELSEWHERE
    for wrong in ("walk.bvh", "bvh:", "bvh:a@1", "bvh:a@1,2,3,4", "bvh:a@x,y", "bvh:a@1,nan"):
        with pytest.raises(WorldError, match="give"):
            Setup(person=wrong)
