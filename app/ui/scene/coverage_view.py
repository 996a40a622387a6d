"""What the skin would see of what comes to the arm, as colours on the arm's surface.

Patches are points that hang on their links; only colours are sent, when another posture or another
set of working sensors was looked at (`app.coverage.beside`). Blue: what comes to the patch is seen
far out, on half of the open ways or more. Pale: late. Red: not at all before it touches.
"""

from collections.abc import Sequence
from threading import Thread

import numpy as np
import viser
from numpy.typing import NDArray

from app.coverage.beside import WITHIN, Asked, Beside, Seen, Ways
from app.coverage.look import Subject, subject_of
from app.coverage.patches import posed
from app.messages import Array, Snapshot
from app.perception.unable import SEEING
from app.ui.chosen import NOBODY
from app.ui.colours import ALARM
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.picking import off_ray
from app.ui.scene.switch import Switch
from app.ui.words import link_words

PATCHES = 2000
PERIOD = 0.4  # [s] between two questions, at least
MOVED = 0.02  # [m] or rotation, of any link, that makes another posture
LIFT = 0.002  # [m] off the surface
FAR = 0.4  # [m] seen that far out is as good as can be
NEAR_COLOUR, FAR_COLOUR = np.array([225.0, 222.0, 205.0]), np.array([10.0, 80.0, 170.0])
BLIND = 0.02  # [m] seen no sooner is not seen
SIZE = 0.011
NEAR_RAY = 0.02  # [rad] off a click
LITTLE = 5e-4  # of the whole
MOST = 4  # sensors that are named
OFF = "Coverage: looking"


class CoverageView:
    """A cloud of patches a link; words of it all and of the patch that was clicked."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        """The words stand where the page is being built."""
        self._server, self._engine = server, engine
        self._links = [link_words(link) for link in engine.robot.links]
        self.words = server.gui.add_markdown(OFF, visible=False)
        self.clouds: dict[int, viser.PointCloudHandle] = {}
        self._beside: Beside | None = None
        self._subject: Subject | None = None
        self._finding: Thread | None = None
        self._asked: Asked | None = None
        self._patch = NOBODY
        self._pace, self._on = Every(PERIOD), False

    def update(self, snapshot: Snapshot) -> None:
        if not self._on:
            return
        if self._beside is None:
            self._begin()
            return
        try:
            seen = self._beside.answer()
        except RuntimeError as error:
            self._set(False)
            self.words.visible = True
            self.words.content = f"Coverage has failed: {error}; switch it on again"
            return
        if seen is not None:
            self._show(seen)
        working = np.isin(snapshot.unable, SEEING)
        asked = Asked(snapshot.T_base_link, working, self._patch)
        if self._pace.due(snapshot.stamp) and self._other(asked) and self._beside.ask(asked):
            self._asked = asked

    def click(self, origin: Array, direction: Array, snapshot: Snapshot) -> None:
        """A ray into the scene: more is told of the patch that it meets first."""
        if not self._on or self._subject is None:
            return
        at = posed(self._subject.patches, snapshot.T_base_link)
        off = off_ray(origin, direction, at.point)
        faces = at.normal @ direction < 0.0
        depth = np.where((off < NEAR_RAY) & faces, (at.point - origin) @ direction, np.inf)
        self._patch = int(depth.argmin()) if np.isfinite(depth).any() else NOBODY

    def switches(self) -> list[Switch]:
        help_ = "how far out the skin sees what comes to each part; red: not before it touches"
        return [Switch("Coverage", self._on, self._set, help_)]

    def close(self) -> None:
        """End the process that looks."""
        if self._beside is not None:
            self._beside.close()

    def _set(self, on: bool) -> None:
        self._on, self._asked, self._patch = on, None, NOBODY
        self.words.visible, self.words.content = on, OFF
        if not on:
            for cloud in self.clouds.values():
                cloud.visible = False

    def _begin(self) -> None:
        """Find the patches, which takes a while, in a thread of its own; then the process."""
        if self._finding is not None and self._finding.is_alive():
            return
        if self._subject is None:
            self._finding = Thread(target=self._find, name="coverage", daemon=True)
            self._finding.start()
            return
        patches, links = self._subject.patches, self._engine.robot.links
        self._beside = Beside(self._subject)
        for i in np.unique(patches.link).tolist():
            mine = patches.link == i
            points = patches.point[mine] + LIFT * patches.normal[mine]
            self.clouds[i] = self._server.scene.add_point_cloud(
                f"/robot/{links[i]}/coverage",
                points.astype(np.float32),
                np.tile(NEAR_COLOUR.astype(np.uint8), (len(points), 1)),
                point_size=SIZE,
                point_shape="circle",
                precision="float32",
                visible=False,
            )

    def _find(self) -> None:
        self._subject = subject_of(self._engine.robot, self._engine.skin, PATCHES)

    def _other(self, asked: Asked) -> bool:
        last = self._asked
        if last is None or last.patch != asked.patch:
            return True
        if not np.array_equal(last.working, asked.working):
            return True
        return bool(np.abs(last.T_base_link - asked.T_base_link).max() > MOVED)

    def _show(self, seen: Seen) -> None:
        assert self._subject is not None
        colours, link = colours_of(seen.gap), self._subject.patches.link
        for i, cloud in self.clouds.items():
            cloud.colors = colours[link == i]
            cloud.visible = self._on
        words = words_of(seen, self._links)
        if seen.ways is not None:
            names = [s.name for s in self._engine.skin.sensors]
            words += "\n\n" + patch_words(seen.ways, self._links[link[seen.ways.patch]], names)
        self.words.content = words


def colours_of(gap: Array) -> NDArray[np.uint8]:
    """(P, 3) of patches by the gap (P,) [m] at which what comes to them is seen."""
    share = np.clip(np.nan_to_num(gap) / FAR, 0.0, 1.0)[:, None]
    out = NEAR_COLOUR + share * (FAR_COLOUR - NEAR_COLOUR)
    out[np.isfinite(gap) & (gap < BLIND)] = ALARM
    return np.asarray(out.round(), dtype=np.uint8)


def words_of(seen: Seen, links: Sequence[str]) -> str:
    """Of all that moves, what sensors that cannot see cost of it, and the links, worst first."""
    before = f"{100 * WITHIN:.0f} cm before it touches"
    out = f"**{100 * seen.whole:.0f} %** of what comes is seen {before}"
    if seen.lost > LITTLE:
        out += f"; sensors that cannot see cost **{100 * seen.lost:.1f}** points"
    known = [i for i in np.argsort(seen.share) if np.isfinite(seen.share[i])]
    return out + ". " + ", ".join(f"{links[i]} {100 * seen.share[i]:.0f} %" for i in known)


def patch_words(ways: Ways, link: str, names: Sequence[str]) -> str:
    """Who sees what comes to a patch."""
    unseen = ways.open - sum(n for _, n, _ in ways.first)
    if not ways.open:
        return f"Here on the {link} the arm itself is in every way."
    by = ", ".join(f"{names[k]} from {100 * far:.0f} cm ({n})" for k, n, far in ways.first[:MOST])
    seen = f"first by {by}" if by else "by nobody"
    return f"Here on the {link}, of {ways.open} ways: seen {seen}; unseen on {unseen}."
