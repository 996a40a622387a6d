"""Meshes and files that no native code may be given, refused in one line before it sees them."""

import json
import os
import struct

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.config import load_params
from app.control.capsules import fit_capsules
from app.errors import ConfigError, RobotError, WorldError
from app.robot.meshes import BodyMesh
from app.robot.model import load_urdf
from app.setup import Setup
from app.surface import check_surface, read_surfaces
from app.text_file import read_file
from app.toml import read_toml
from app.world.scene import load_scene
from app.world.shapes import make_shape

BOX = trimesh.creation.box((0.1, 0.1, 0.3))


def ply(path, vertices, faces):
    """A PLY file of exactly these, checked by nobody."""
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    rows = [" ".join(map(str, v)) for v in vertices] + [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text(head + "\n".join(rows) + "\n")
    return path


def glb(path, indices):
    """A glTF of three vertices whose one face names `indices`."""
    data = np.eye(3, dtype="<f4").tobytes() + np.array(indices, dtype="<u2").tobytes() + b"\0\0"
    gltf = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return path


def urdf(tmp_path, mesh):
    """An arm of one joint whose second link is that mesh."""
    file = tmp_path / "arm.urdf"
    file.write_text(
        '<robot name="arm"><link name="base"><collision><geometry><box size="0.1 0.1 0.1"/>'
        '</geometry></collision></link><link name="tip"><collision><geometry>'
        f'<mesh filename="{mesh.name}"/></geometry></collision></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'
    )
    return file


CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
SOLID = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
BAD = {
    "index": (CORNERS, [*SOLID, (0, 1, 99)]),
    "negative": (CORNERS, [*SOLID, (0, 1, -7)]),
    "flat": ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], SOLID),
    "point": ([(0, 0, 0)] * 4, SOLID),
    "far": ([*CORNERS[:3], (0, 0, 1e9)], SOLID),
    "nan": ([*CORNERS[:3], (0, 0, "nan")], SOLID),
    "infinite": ([*CORNERS[:3], (0, 0, "inf")], SOLID),
    "empty": (CORNERS, []),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_mesh_that_native_code_would_fall_over_is_one_line_as_a_link_and_in_a_scene(
    tmp_path, kind
):
    file = ply(tmp_path / "bad.ply", *BAD[kind])
    for load, error in (
        (lambda: load_urdf(urdf(tmp_path, file)), RobotError),
        (lambda: make_shape({"kind": "mesh", "file": file.name}, tmp_path, "scene"), WorldError),
    ):
        with pytest.raises(error, match=r"bad\.ply|link 'tip'") as e:
            load()
        assert "\n" not in str(e.value)


def test_indices_of_a_gltf_beyond_its_vertices_are_one_line(tmp_path):
    with pytest.raises(RobotError, match=r"bad\.glb"):
        load_urdf(urdf(tmp_path, glb(tmp_path / "bad.glb", (0, 1, 40000))))
    assert read_surfaces(glb(tmp_path / "good.glb", (0, 1, 2)), RobotError).geometry


def test_a_surface_of_one_thin_but_real_face_passes():
    check_surface(np.array(CORNERS, float), np.array([(0, 1, 2)]), "it", RobotError)


def test_what_a_mesh_refers_to_outside_its_folder_is_never_opened(tmp_path):
    folder = tmp_path / "inside"
    folder.mkdir()
    pipe = tmp_path / "secret.mtl"
    os.mkfifo(pipe)  # whoever opens it hangs
    (folder / "a.obj").write_text(
        "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl x\n"
        "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    assert len(read_surfaces(folder / "a.obj", RobotError).to_mesh().faces) == 4
    (folder / "b.gltf").write_text(
        json.dumps(
            {
                "asset": {"version": "2.0"},
                "buffers": [{"byteLength": 36, "uri": "../secret.mtl"}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "nodes": [{"mesh": 0}],
                "scenes": [{"nodes": [0]}],
            }
        )
    )
    with pytest.raises(RobotError, match="not a readable mesh"):
        read_surfaces(folder / "b.gltf", RobotError)


def test_a_kind_of_mesh_that_is_not_read_is_told_with_those_that_are(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK\x03\x04")
    with pytest.raises(RobotError, match="export one of stl, obj"):
        read_surfaces(tmp_path / "a.zip", RobotError)


def test_a_body_of_hundreds_of_metres_is_fitted_in_no_time():
    big = trimesh.creation.box((400.0, 90.0, 90.0))
    body = BodyMesh(np.array(big.vertices), np.array(big.faces, dtype=np.int64))
    c = fit_capsules([body])
    assert np.isfinite(c.radius).all()


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_a_number_that_is_none_is_refused_wherever_it_stands(tmp_path, value):
    scene = tmp_path / "a.toml"
    scene.write_text(
        'title = "a"\n[[body]]\nname = "b"\nshape = {kind = "sphere", radius_m = 0.1}\n'
        f"position_m = [0.1, {value}, 0.3]\n"
    )
    with pytest.raises(WorldError, match="position_m"):
        load_scene(scene)
    settings = tmp_path / "s.toml"
    settings.write_text(f"d0 = {value}\n")
    with pytest.raises(ConfigError, match="d0"):
        load_params(settings)


def test_a_negative_seed_is_one_line_in_every_command(capsys):
    with pytest.raises(ConfigError, match="seed = -1"):
        Setup(seed=-1)
    for command in (
        ("run", "--headless"), ("bench", "control"), ("coverage",), ("skin", "check"),
        ("experiment", "phantoms"),
    ):  # fmt: skip
        assert main([*command, "--seed", "-1"]) == 1, command
        assert capsys.readouterr().err == "flinch: seed = -1; give a whole number from 0\n"


def test_devices_pipes_folders_and_files_without_end_are_refused_unopened(tmp_path):
    pipe = tmp_path / "p.toml"
    os.mkfifo(pipe)
    for path, says in (
        (pipe, "is a pipe"), (os.devnull, "is a device"), ("/dev/zero", "is a device"),
        (tmp_path, "is a folder"), (tmp_path / "none", "cannot be read"),
    ):  # fmt: skip
        path = type(tmp_path)(path)
        for read in (
            lambda p=path: read_toml(p, dict, ConfigError),
            lambda p=path: load_params(p),
            lambda p=path: read_file(p, ConfigError),
        ):
            with pytest.raises(ConfigError, match=says):
                read()
    large = tmp_path / "large.toml"
    with large.open("wb") as file:
        file.truncate(2**40)  # of which nothing is on the disk
    with pytest.raises(ConfigError, match="64 MB at most"):
        read_toml(large, dict, ConfigError)


def test_a_urdf_that_is_a_pipe_is_refused(tmp_path):
    pipe = tmp_path / "arm.urdf"
    os.mkfifo(pipe)
    with pytest.raises(RobotError, match="is a pipe"):
        load_urdf(pipe)
