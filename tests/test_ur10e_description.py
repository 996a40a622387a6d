"""The UR10e's description: its kinematics are the maker's table, its meshes are sound."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

FOLDER = Path(__file__).parent.parent / "robots/ur10e"
URDF = FOLDER / "ur10e.urdf"
LINKS = (
    "base_link_inertia",
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
)
# Denavit-Hartenberg table of the UR10e: d [m], a [m], alpha [rad], as the maker publishes it.
DH = (
    (0.1807, 0.0, np.pi / 2),
    (0.0, -0.6127, 0.0),
    (0.0, -0.57155, 0.0),
    (0.17415, 0.0, np.pi / 2),
    (0.11985, 0.0, -np.pi / 2),
    (0.11655, 0.0, 0.0),
)
# The table speaks in the controller's frame, which is half a turn from base_link.
T_BASE_CONTROLLER = np.diag([-1.0, -1.0, 1.0, 1.0])


@cache
def model() -> pin.Model:
    return pin.buildModelFromUrdf(str(URDF))


def tool_by_urdf(q: np.ndarray) -> np.ndarray:
    """(4, 4) T_base_tool0 by pinocchio."""
    data = model().createData()
    pin.framesForwardKinematics(model(), data, q)
    base = data.oMf[model().getFrameId("base_link")]
    return (base.inverse() * data.oMf[model().getFrameId("tool0")]).homogeneous


def tool_by_table(q: np.ndarray) -> np.ndarray:
    """(4, 4) T_base_tool0 by the Denavit-Hartenberg table."""
    T = T_BASE_CONTROLLER
    for angle, (d, a, alpha) in zip(q, DH, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        step = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        T = T @ np.array(step)
    return T


@cache
def body(link: str) -> trimesh.Trimesh:
    return trimesh.load(FOLDER / f"meshes/body/{link}.stl", force="mesh")


def test_the_tool_is_where_the_makers_table_puts_it() -> None:
    rng = np.random.default_rng(20261122)
    for q in rng.uniform(-2 * np.pi, 2 * np.pi, (1000, 6)):
        ours, table = tool_by_urdf(q), tool_by_table(q)
        np.testing.assert_allclose(ours[:3, 3], table[:3, 3], rtol=0, atol=1e-6)
        turn = pin.log3(ours[:3, :3].T @ table[:3, :3])
        assert np.linalg.norm(turn) < 1e-6


def test_one_posture_gives_the_known_tool_position() -> None:
    p = tool_by_urdf(np.array([0.3, -1.7, 1.9, -1.6, -1.5, 0.2]))[:3, 3]
    np.testing.assert_allclose(p, [0.49977, 0.34552, 0.53981], rtol=0, atol=1e-5)


def test_joints_have_the_makers_names_and_limits() -> None:
    names = [name for name in model().names if name != "universe"]
    assert names == [
        "shoulder_pan_joint",
        "shoulder_lift_joint",
        "elbow_joint",
        "wrist_1_joint",
        "wrist_2_joint",
        "wrist_3_joint",
    ]
    whole = 2 * np.pi
    upper = [whole, whole, np.pi, whole, whole, whole]
    np.testing.assert_allclose(model().upperPositionLimit, upper)
    np.testing.assert_allclose(model().lowerPositionLimit, np.negative(upper))
    np.testing.assert_allclose(model().velocityLimit, np.radians([120, 120, 180, 180, 180, 180]))
    np.testing.assert_allclose(model().effortLimit, [330, 330, 150, 54, 54, 54])


def test_every_link_names_one_visual_and_one_body_mesh_in_its_own_frame() -> None:
    links = {e.get("name"): e for e in ET.parse(URDF).getroot().iter("link")}
    for name in LINKS:
        for kind, path in (("visual", f"visual/{name}.glb"), ("collision", f"body/{name}.stl")):
            (element,) = links[name].findall(kind)
            assert element.find("origin") is None
            mesh = element.find("geometry/mesh")
            assert mesh is not None and mesh.get("filename") == f"meshes/{path}"
            assert (FOLDER / "meshes" / path).is_file()


@pytest.mark.parametrize("link", LINKS)
def test_a_body_is_watertight_and_its_faces_look_outward(link: str) -> None:
    mesh = body(link)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume > 0
    assert len(mesh.faces) <= 3000


def test_all_bodies_together_have_at_most_20000_faces() -> None:
    assert sum(len(body(link).faces) for link in LINKS) <= 20_000


def test_visual_meshes_take_at_most_3_megabytes() -> None:
    sizes = [(FOLDER / f"meshes/visual/{link}.glb").stat().st_size for link in LINKS]
    assert sum(sizes) <= 3_000_000


@pytest.mark.parametrize("link", LINKS)
def test_a_visual_mesh_fills_the_same_space_as_its_body(link: str) -> None:
    scene = trimesh.load(FOLDER / f"meshes/visual/{link}.glb")
    np.testing.assert_allclose(scene.bounds, body(link).bounds, rtol=0, atol=1.5e-3)


@pytest.mark.parametrize(
    ("link", "offset", "stations", "radius"),
    [
        ("upper_arm_link", 0.1762, (-0.49, -0.35, -0.20), 0.0552),
        ("forearm_link", 0.0393, (-0.48, -0.30, -0.11), 0.0427),
    ],
)
def test_a_tube_has_its_radius_within_a_millimetre(
    link: str, offset: float, stations: tuple[float, ...], radius: float
) -> None:
    for x in stations:
        cut = trimesh.intersections.mesh_plane(body(link), [1, 0, 0], [x, 0, 0]).reshape(-1, 3)
        away = np.hypot(cut[:, 1], cut[:, 2] - offset)
        assert np.abs(away - radius).max() < 1e-3


@pytest.mark.parametrize("link", LINKS)
def test_an_inertia_is_one_that_a_body_can_have(link: str) -> None:
    element = next(e for e in ET.parse(URDF).getroot().iter("link") if e.get("name") == link)
    tensor = element.find("inertial/inertia")
    assert tensor is not None
    i = {key: float(tensor.get(key, "nan")) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    matrix = [
        [i["ixx"], i["ixy"], i["ixz"]],
        [i["ixy"], i["iyy"], i["iyz"]],
        [i["ixz"], i["iyz"], i["izz"]],
    ]
    a, b, c = np.linalg.eigvalsh(np.array(matrix))
    assert a > 0
    assert a + b >= c
    mass = element.find("inertial/mass")
    assert mass is not None and float(mass.get("value", "nan")) > 0


def lenses() -> np.ndarray:
    """(30, 3) [m]: lens centres of the three rings, in the frame of forearm_link."""
    layout = tomllib.loads((FOLDER / "skin/forearm-rings.toml").read_text())
    points = []
    for ring in layout["ring"]:
        start, axis = np.array(ring["start"]), np.array(ring["axis"])
        for turn in 2 * np.pi * np.arange(ring["count"]) / ring["count"]:
            ray = np.cos(turn) * start + np.sin(turn) * np.cross(axis, start)
            points.append(ring["centre_m"] + ring["radius_m"] * ray)
    return np.array(points)


def test_the_skin_cover_is_sound_and_clears_the_tube() -> None:
    cover = body("skin_cover")
    assert cover.is_volume
    assert cover.body_count == 3
    assert len(cover.faces) <= 3000
    assert np.hypot(cover.vertices[:, 1], cover.vertices[:, 2] - 0.0393).min() > 0.0427


def test_every_lens_sits_free_in_a_window_of_the_cover() -> None:
    cover, points = body("skin_cover"), lenses()
    gap = -trimesh.proximity.signed_distance(cover, points)
    assert len(points) == 30
    assert gap.min() > 0.5e-3
    assert gap.max() < 1.5e-3
