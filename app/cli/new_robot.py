"""`flinch new-robot`: a robot folder for a URDF, to be edited."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.robot.tables import Bodies


@dataclass(frozen=True)
class NewRobot:
    """Write a robot folder for a URDF: robot.toml, a copy of its meshes, and a layout with rings of
    sensors. `flinch run --robot FOLDER` takes it as it stands; edit what does not fit."""

    urdf: tyro.conf.Positional[Path]
    """The URDF file; its meshes must be there."""
    ring: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """LINK:COUNT sensors round a link, where it is round; give it once for each ring."""
    bodies: Bodies = "collision"
    """Meshes of the URDF that distances are measured to, and that the rings go round."""
    out: Path | None = None
    """The folder to write; default: the robot's name, here."""

    def __call__(self) -> None:
        from app.robot.draft import parse_wish, write_draft

        wishes = [parse_wish(text) for text in self.ring]
        out = self.out or Path(self.urdf.stem)
        robot, rings = write_draft(self.urdf, wishes, out, self.bodies)
        print(f"{out}: {robot.name}, {robot.n} joints, {len(robot.links)} bodies")
        for r in rings:
            at = ", ".join(f"{c + 0.0:.3f}" for c in r.centre.round(4))
            print(f"  {r.sensors} sensors round {r.link} at ({at}) m, radius {r.radius:.3f} m")
        print(f"Next: flinch doctor --robot {out}, then edit {out}/robot.toml and its layout,")
        print(f"{out}/skin/rings.toml, and flinch run --robot {out}")
