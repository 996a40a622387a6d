"""Swan 7: an arm of our own with seven joints, written as meshes and as a URDF from one table.

    make robot

A stack of four pieces, each two links: a roll link that ends in a fork, and a pitch link whose
hub turns between the fork's cheeks and which ends where the next roll link begins.

        | tube |            pitch link: hub between the cheeks, tube upwards
      ||( hub  )||          fork of the roll link below: two cheeks
      |          |
      |   roll   |          roll link: turns about the piece's own axis

All axes meet the arm's middle line, so that the arm stands straight up at zero. Lengths in
metres, z along the arm; every mesh lies in its link's frame. Masses follow from the meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from manifold3d import Manifold

HERE = Path(__file__).parent
DENSITY = 1100.0  # [kg/m^3] of a casting with motors, spread evenly
COLOURS = {"shell": (236, 238, 240), "hub": (36, 120, 124)}  # sRGB
PLAY = 0.002  # [m] between a hub and its cheeks, and below a roll link
CLEAR = 0.03  # [m] from a hub's rim to where the full tube clears the cheeks at 110 degrees
SEGMENTS = {"visual": 72, "body": 32}
ROLL, PITCH = (170.0, (0, 0, 1)), (110.0, (0, 1, 0))  # limit either way [deg] and axis


@dataclass(frozen=True)
class Piece:
    """Sizes [m]: a roll link up to the hub of its fork, and the pitch link on that hub."""

    to_hub: float  # from the roll link's foot to the pitch axis
    to_end: float  # from the pitch axis to the next roll link's foot
    roll: float  # radius of the roll link
    hub: float  # radius of the hub
    cheek: tuple[float, float]  # inner and outer y of a cheek
    neck: float  # free height between the roll link and the pitch axis
    tube: float  # radius of the pitch link's tube


SHOULDER = Piece(0.15, 0.21, 0.066, 0.058, (0.043, 0.066), 0.09, 0.055)
ELBOW = Piece(0.21, 0.21, 0.060, 0.052, (0.039, 0.060), 0.082, 0.050)
WRIST = Piece(0.21, 0.07, 0.050, 0.044, (0.033, 0.050), 0.07, 0.042)
BASE_HEIGHT, BASE_RADIUS, FOOT_RADIUS = 0.15, 0.070, 0.100
FLANGE_HEIGHT, FLANGE_RADIUS = 0.07, 0.042
SPEED = (100.0, 100.0, 120.0, 120.0, 150.0, 150.0, 180.0)  # [deg/s]
EFFORT = (180, 180, 100, 100, 40, 40, 40)  # [N m]

Parts = dict[str, Manifold]  # colour -> solid


def upright(low: float, high: float, radius: float, n: int, chamfer: float = 0.004) -> Manifold:
    """A cylinder along z with broken edges."""
    body = Manifold.cylinder(high - low - 2 * chamfer, radius, radius, n)
    end = Manifold.cylinder(high - low, radius - chamfer, radius - chamfer, n)
    return Manifold.batch_hull([body.translate((0, 0, low + chamfer)), end.translate((0, 0, low))])


def across(low: float, high: float, radius: float, n: int) -> Manifold:
    """A cylinder along y about the origin."""
    return upright(low, high, radius, n).rotate((-90, 0, 0))


def roll_link(p: Piece, n: int) -> Parts:
    """From its foot at z = 0 to a fork round the pitch axis at z = to_hub."""
    top = p.to_hub - p.neck
    shell = upright(PLAY, top, p.roll, n)
    inner, outer = p.cheek
    for side in (1, -1):
        low, high = sorted((side * inner, side * outer))
        disc = across(low, high, p.hub, n).translate((0, 0, p.to_hub))
        slab = Manifold.cylinder(0.01, p.roll, p.roll, n).translate((0, 0, top - 0.014))
        slab = slab.trim_by_plane((0, side, 0), inner)
        shell += Manifold.batch_hull([disc, slab])
    low, high = outer - 0.006, outer + 0.004
    caps = [across(low, high, 0.7 * p.hub, n), across(-high, -low, 0.7 * p.hub, n)]
    hub = (caps[0] + caps[1]).translate((0, 0, p.to_hub))
    return {"shell": shell, "hub": hub}


def pitch_link(p: Piece, n: int) -> Parts:
    """From a hub about the origin, axis y, to its end at z = to_end.

    The tube is slim until it clears the cheeks at the joint's limit; a short one stays slim.
    """
    wide = p.cheek[0] - PLAY
    shell = upright(0.0, p.to_end, min(p.tube, wide), n)
    if p.to_end - p.hub > 2 * CLEAR:
        shell += upright(p.hub + CLEAR, p.to_end, p.tube, n, 0.010)
    return {"hub": across(-wide, wide, p.hub, n), "shell": shell}


def links(n: int) -> dict[str, Parts]:
    """Every link's parts, in its own frame; n segments a turn."""
    base = upright(0.0, 0.02, FOOT_RADIUS, n) + upright(0.01, BASE_HEIGHT, BASE_RADIUS, n)
    flange = upright(PLAY, FLANGE_HEIGHT, FLANGE_RADIUS, n)
    band = upright(0.03, 0.045, FLANGE_RADIUS + 0.001, n, 0.001)
    made: dict[str, Parts] = {"base_link": {"shell": base}}
    for i, piece in enumerate((SHOULDER, ELBOW, WRIST)):
        made[f"link{2 * i + 1}"] = roll_link(piece, n)
        made[f"link{2 * i + 2}"] = pitch_link(piece, n)
    made["link7"] = {"shell": flange, "hub": band}
    return made


def joint_heights() -> list[float]:
    """z of each joint in the link below it [m]."""
    heights = [BASE_HEIGHT]
    for piece in (SHOULDER, ELBOW, WRIST):
        heights += [piece.to_hub, piece.to_end]
    return heights


# --- Meshes and URDF -----------------------------------------------------------------------------
def surface(solid: Manifold) -> trimesh.Trimesh:
    mesh = solid.to_mesh()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=np.float64)
    return trimesh.Trimesh(vertices, np.asarray(mesh.tri_verts, dtype=np.int64), process=False)


def whole(parts: Parts) -> trimesh.Trimesh:
    """All parts as one watertight surface."""
    solids = list(parts.values())
    solid = solids[0]
    for other in solids[1:]:
        solid = solid + other
    mesh = surface(solid.simplify(1e-5))
    if not mesh.is_volume:
        raise ValueError("a link is not watertight: take other sizes")
    return mesh


def write_visual(parts: Parts, path: Path) -> None:
    """One geometry a colour, smooth but for edges."""
    scene = trimesh.Scene()
    for name, solid in parts.items():
        mesh = trimesh.graph.smooth_shade(surface(solid), angle=np.radians(25))
        linear = [(v / 255) ** 2.2 for v in COLOURS[name]]
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=name,
                baseColorFactor=[*linear, 1.0],
                metallicFactor=0.05,
                roughnessFactor=0.45,
            )
        )
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    path.write_bytes(scene.export(file_type="glb", include_normals=True))


def inertial(mesh: trimesh.Trimesh) -> str:
    """Mass, centre and inertia of the evenly filled link."""
    mass, tensor = DENSITY * mesh.volume, DENSITY * np.asarray(mesh.moment_inertia)
    c = " ".join(f"{v:.6f}" for v in np.round(mesh.center_mass, 6) + 0.0)
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
    names["izz"] = (2, 2)
    entries = " ".join(f'{k}="{np.round(tensor[at], 8) + 0.0:.8f}"' for k, at in names.items())
    return (
        f'    <inertial>\n      <origin xyz="{c}" rpy="0 0 0"/>\n'
        f'      <mass value="{mass:.4f}"/>\n      <inertia {entries}/>\n    </inertial>\n'
    )


def link_text(name: str, mesh: trimesh.Trimesh) -> str:
    files = (("visual", f"visual/{name}.glb"), ("collision", f"body/{name}.stl"))
    shapes = "".join(
        f"    <{kind}>\n"
        f'      <geometry><mesh filename="meshes/{file}"/></geometry>\n'
        f"    </{kind}>\n"
        for kind, file in files
    )
    return f'  <link name="{name}">\n{inertial(mesh)}{shapes}  </link>\n'


def joint_text(i: int, parent: str, height: float) -> str:
    limit, axis = PITCH if i % 2 else ROLL
    reach, speed = np.radians(limit), np.radians(SPEED[i])
    return (
        f'  <joint name="joint{i + 1}" type="revolute">\n'
        f'    <parent link="{parent}"/>\n    <child link="link{i + 1}"/>\n'
        f'    <origin xyz="0 0 {height:g}" rpy="0 0 0"/>\n'
        f'    <axis xyz="{" ".join(map(str, axis))}"/>\n'
        f'    <limit lower="{-reach:.12f}" upper="{reach:.12f}" effort="{EFFORT[i]}" '
        f'velocity="{speed:.12f}"/>\n  </joint>\n'
    )


def main(folder: Path = HERE) -> None:
    """Write `meshes/` and `swan7.urdf` into a folder."""
    for kind in ("visual", "body"):
        (folder / "meshes" / kind).mkdir(parents=True, exist_ok=True)
    text = '<?xml version="1.0"?>\n<!-- Written by model.py: change the table there. -->\n'
    text += '<robot name="swan7">\n'
    bodies = {name: whole(parts) for name, parts in links(SEGMENTS["body"]).items()}
    for name, parts in links(SEGMENTS["visual"]).items():
        body = bodies[name]
        write_visual(parts, folder / "meshes/visual" / f"{name}.glb")
        body.export(folder / "meshes/body" / f"{name}.stl")
        text += link_text(name, body)
        print(f"{name:12} {DENSITY * body.volume:5.2f} kg  body {len(body.faces):5} faces")
    text += '  <link name="tool0"/>\n'
    for i, height in enumerate(joint_heights()):
        text += joint_text(i, f"link{i}" if i else "base_link", height)
    text += (
        '  <joint name="link7-tool0" type="fixed">\n    <parent link="link7"/>\n'
        f'    <child link="tool0"/>\n    <origin xyz="0 0 {FLANGE_HEIGHT:g}" rpy="0 0 0"/>\n'
        "  </joint>\n</robot>\n"
    )
    (folder / "swan7.urdf").write_text(text)


if __name__ == "__main__":
    main()
