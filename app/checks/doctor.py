"""Is this robot sound? Every fact of its folder that can be wrong without a word, with remedies.

Examined at the home posture: inertias, limits, meshes, sensors, self-intersections, frames. A
finding is a measured value beside its limit; the report's checks are the worst of each kind.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import trimesh

from app.judge.truth import distance_between, surface
from app.messages import Array, Cloud, Verdict
from app.perception.proximity import BodyPairs
from app.report import Check, Report
from app.robot.blind import blind_sensors, blind_words_of
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

FACES, ALL_FACES = 3000, 20_000  # of a body mesh, and of all: closest pairs within their time
SIZE = (0.005, 3.0)  # [m] of a link; beyond, the mesh is in other units
GAP = 0.3  # [m] of a frame from the mesh that belongs to it
MARGIN = 0.02  # [rad or m] of home from a limit: control keeps this much free
APART = 0.1  # [mm] what is nearer touches
TURNING, SLIDING = 25.0, 10.0  # [rad/s], [m/s] that no arm reaches: 10.7 rad/s is a small one's
TURN, TRAVEL = 20.0, 50.0  # [rad] three turns, [m] a long gantry: a joint's limits reach no further
FULL_TURN = 6.3  # [rad] of an origin's rpy
REACH = 5.0  # [m] from a joint to the next
STILL = 1e-6  # of a joint's axis: one of no length moves nothing


@dataclass(frozen=True, slots=True)
class Finding:
    """One measured fact of one link, joint or sensor; `remedy` holds where it is missed."""

    check: Check
    subject: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Checkup:
    """What the examinations look at; `skin` is None for a robot without sensors."""

    robot: Robot
    skin: Skin | None
    posture: Posture


def examine(robot: Robot, skin: Skin | None) -> Report:
    """All examinations as one report: a row a finding, a check the worst of its kind."""
    checkup = Checkup(robot, skin, robot.posture(robot.home))
    findings = [f for look in EXAMINATIONS for f in look(checkup)]
    rows = [
        {
            "name": f.check.name,
            "subject": f.subject,
            "value": f.check.value,
            "unit": f.check.unit,
            "limit": f.check.limit,
            "ok": f.check.ok,
            "remedy": "" if f.check.ok else f.remedy,
        }
        for f in findings
    ]
    return Report("doctor", 0, rows, _worst(findings))


def to_table(report: Report) -> str:
    """One line a check: the worst value and how many were looked at; what is missed follows."""
    lines = []
    for c in report.checks:
        of = [r for r in report.rows if r["name"] == c.name]
        missed = [r for r in of if not r["ok"]]
        side = ">=" if c.at_least else "<="
        verdict = f"MISSED {len(missed)} of {len(of)}" if missed else f"ok {len(of)}"
        value = f"{c.value:.4g} {c.unit} ({side} {c.limit:g})"
        lines.append(f"  {c.name:<38} {value:<34} {verdict}")
        for row in missed:
            lines.append(
                f"      {row['subject']}: {row['value']:.4g} {row['unit']}; {row['remedy']}"
            )
    wrong = sum(not c.ok for c in report.checks)
    lines.append(f"  {wrong} of {len(report.checks)} checks missed" if wrong else "  sound")
    return "\n".join(lines)


def _worst(findings: list[Finding]) -> list[Check]:
    worst: dict[str, Check] = {}
    for f in findings:
        name = f.check.name
        worst[name] = _worse(worst[name], f.check) if name in worst else f.check
    return list(worst.values())


def _worse(a: Check, b: Check) -> Check:
    """What is not a number, a fact that is missing, is worst of all."""
    if np.isnan(a.value) or np.isnan(b.value):
        return a if np.isnan(a.value) else b
    return min(a, b, key=lambda c: c.value) if a.at_least else max(a, b, key=lambda c: c.value)


# --- examinations -------------------------------------------------------------------------


def _inertias(c: Checkup) -> Iterator[Finding]:
    """A mass above zero, and principal inertias that a body can have: a + b >= c.

    A link that never moves needs none.
    """
    remedy = "give its <inertial> the mass and inertia of the part; a CAD program tells them"
    for link, joints in zip(c.robot.links, c.robot.supports, strict=True):
        if not joints.any():
            continue
        inertial = c.robot.description.links[link].inertial
        mass, moments = np.nan, np.full(3, np.nan)
        if inertial is not None and inertial.mass is not None and inertial.inertia is not None:
            mass, moments = inertial.mass, np.linalg.eigvalsh(inertial.inertia)
        slack = moments[0] + moments[1] - moments[2]
        yield Finding(Check("mass", float(mass), "kg", 1e-6, at_least=True), link, remedy)
        yield Finding(
            Check("smallest principal inertia", float(moments[0]), "kg m2", 1e-12, at_least=True),
            link,
            remedy,
        )
        yield Finding(
            Check("triangle inequality of inertias", float(slack), "kg m2", -1e-9, at_least=True),
            link,
            remedy,
        )


def _limits(c: Checkup) -> Iterator[Finding]:
    r = c.robot
    margin = np.minimum(r.home - r.q_min, r.q_max - r.home)
    for i, joint in enumerate(r.joints):
        yield Finding(
            Check("home within its limits", float(margin[i]), "rad|m", MARGIN, at_least=True),
            joint,
            "move home_deg away from the limit; control keeps this margin free",
        )
        slides = bool(r.slides[i])
        yield Finding(
            Check("velocity of a sliding joint", float(r.qd_max[i]), "m/s", SLIDING)
            if slides
            else Check("velocity limit", float(r.qd_max[i]), "rad/s", TURNING),
            joint,
            "give the joint's <limit> a velocity in "
            + ("m/s, not in mm" if slides else "rad/s, not in degrees"),
        )
        reach = float(max(abs(r.q_min[i]), abs(r.q_max[i])))
        yield Finding(
            Check("limits of a sliding joint", reach, "m", TRAVEL)
            if slides
            else Check("limits of a joint", reach, "rad", TURN),
            joint,
            "give the joint's <limit> in " + ("metres, not in mm" if slides else "radians"),
        )


def _axes(c: Checkup) -> Iterator[Finding]:
    """An axis to turn about or slide along, and origins in metres and radians."""
    for place in c.robot.description.places:
        if place.joint in c.robot.joints:
            yield Finding(
                Check("length of a joint's axis", place.axis, "", STILL, at_least=True),
                place.joint,
                'give the joint an <axis> that is not zero, such as xyz="0 0 1"',
            )
        yield Finding(
            Check("joint from its parent's frame", place.away, "m", REACH),
            place.joint,
            "give the joint's <origin> an xyz in metres, not in mm",
        )
        yield Finding(
            Check("turn of a joint's origin", place.turn, "rad", FULL_TURN),
            place.joint,
            "give the joint's <origin> an rpy in radians, not in degrees",
        )


def _meshes(c: Checkup) -> Iterator[Finding]:
    total = 0
    for link, body in zip(c.robot.links, c.robot.bodies, strict=True):
        mesh = trimesh.Trimesh(body.vertices, body.faces)
        _, shared = np.unique(np.sort(mesh.edges, axis=1), axis=0, return_counts=True)
        total += len(body.faces)
        yield Finding(
            Check("open edges of a body", float((shared != 2).sum()), "", 0.0),
            link,
            "close the mesh's holes and export it as one solid; else inside cannot be told",
        )
        yield Finding(
            Check("faces of a body", float(len(body.faces)), "", FACES),
            link,
            "simplify the collision mesh",
        )
        size = float(np.ptp(mesh.bounds, axis=0).max())
        remedy = 'the mesh is in other units; export in metres or give scale="0.001 0.001 0.001"'
        yield Finding(Check("largest size of a body", size, "m", SIZE[1]), link, remedy)
        yield Finding(
            Check("smallest size of a body", size, "m", SIZE[0], at_least=True), link, remedy
        )
    left_out = [link for link in c.robot.description.body_links if link not in c.robot.links]
    yield Finding(
        Check("shapes left out", float(len(left_out)), "", 0.0),
        ", ".join(left_out) or c.robot.name,
        "add the link to `links` in robot.toml; nobody sees it or keeps clear of it now",
    )
    yield Finding(
        Check("faces of all bodies", float(total), "", ALL_FACES), c.robot.name, "simplify meshes"
    )


def _sensors(c: Checkup) -> Iterator[Finding]:
    if c.skin is None:
        return
    pairs = BodyPairs(c.robot)
    blind = {b.sensor: b for b in blind_sensors(c.robot, c.skin)}
    eye = SimulatedSkin(c.robot, c.skin, World(()), 0, ErrorModel(ideal=True))
    for k, sensor in enumerate(c.skin.sensors):
        T = c.posture.T_base_link[c.skin.link[k]]
        lens = T[:3, :3] @ c.skin.origin[k] + T[:3, 3]
        clear = pairs.update(_cloud(lens), c.posture).minimum
        yield Finding(
            Check("lens before every body", 1e3 * clear, "mm", APART, at_least=True),
            sensor.name,
            "raise the ring's radius_m or move the sensor out of the mesh",
        )
        own = np.flatnonzero(c.robot.welded[c.skin.link[k]])
        blocked = int(np.isin(eye.read(k, c.posture).label, own).sum())
        yield Finding(
            Check("zones that see what they ride on", float(blocked), "", 0.0),
            sensor.name,
            "raise or tilt the sensor, or widen its window: these zones see nothing else",
        )
        remedy = blind_words_of([blind[sensor.name]], c.robot) if sensor.name in blind else ""
        yield Finding(
            Check("looks into what it rides on", float(sensor.name in blind), "", 0.0),
            sensor.name,
            remedy,
        )


def _intersections(c: Checkup) -> Iterator[Finding]:
    """Distances of links that no single joint lies between; neighbours may touch."""
    r = c.robot
    solids = [surface(b.vertices, b.faces) for b in r.bodies]
    joints_between = np.abs(r.supports[:, None] - r.supports).sum(axis=2)
    for i, j in np.argwhere(np.triu(joints_between > 1, 1)):
        d = distance_between(
            solids[i], c.posture.T_base_link[i], solids[j], c.posture.T_base_link[j]
        )
        yield Finding(
            Check("links apart at home", 1e3 * d, "mm", APART, at_least=True),
            f"{r.links[i]} and {r.links[j]}",
            "change home_deg, or mend the meshes where the arm cannot be so",
        )


def _frames(c: Checkup) -> Iterator[Finding]:
    """Each link's frame, and the tool's, is near the mesh that belongs to it; a cover has its
    link's frame."""
    pairs = BodyPairs(c.robot)
    remedy = "check the mesh's <origin> and its units: it should lie round its link's frame"
    for i, link in enumerate(c.robot.links):
        if link in c.robot.covers:
            continue
        d = pairs.update(_cloud(c.posture.T_base_link[i, :3, 3]), c.posture).distance[i]
        yield Finding(Check("link frame from its body", float(d), "m", GAP), link, remedy)
    d = pairs.update(_cloud(c.posture.T_base_tool[:3, 3]), c.posture).minimum
    yield Finding(
        Check("tool frame from the arm", float(d), "m", GAP),
        c.robot.tool_frame,
        "name the flange or the tool's tip as tool_frame",
    )


def _cloud(point: Array) -> Cloud:
    """One kept point (3,), base frame."""
    return Cloud(
        points=point[None].copy(),
        verdict=np.array([Verdict.KEPT], dtype=np.uint8),
        link=np.array([-1], dtype=np.int16),
        gap=np.array([np.inf]),
        eps=np.array([np.nan]),
        stamp=np.zeros(1),
    )


EXAMINATIONS: tuple[Callable[[Checkup], Iterator[Finding]], ...] = (
    _inertias,
    _limits,
    _axes,
    _meshes,
    _sensors,
    _intersections,
    _frames,
)
