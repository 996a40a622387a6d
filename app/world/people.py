"""Who is in a scene, where a person at the command line wants others than the scene has.

'' leaves the scene as it is, 'none' empties it, and 'bvh:FILE[@X,Y[,HEADING]]' has one person
play a motion file from a place [m] on, looking to a heading [degrees]; left out, both are those
of the scene's first person.
"""

from pathlib import Path

import numpy as np

from app.errors import WorldError
from app.world.tables import PersonTable, StopTable

NOBODY, CLIP = "none", "bvh:"
# on the page: nobody, or one who walks past the arm, or works beside it as in the scene `cell`
WHO: dict[str, tuple[PersonTable, ...]] = {
    NOBODY: (),
    "walks": (
        PersonTable(
            "person", speed_mps=0.9, seed=1,
            stops=(StopTable((-0.9, 0.95), 1.0), StopTable((1.5, 0.95), 1.0)),
        ),
    ),
    "works": (
        PersonTable(
            "person", speed_mps=0.6, seed=1,
            stops=(
                StopTable((-0.15, 0.76), 3.0, (-0.30, 0.37, 0.22)),
                StopTable((0.60, 0.76), 3.0, (0.70, 0.32, 0.35)),
            ),
        ),
    ),
}  # fmt: skip
ELSEWHERE = (0.3, 1.2)  # [m] of a clip in a scene without people: to the left of the arm


def check_people(words: str) -> None:
    """WorldError for words that name nobody, before anything is built."""
    people_instead((), words)


def people_instead(people: tuple[PersonTable, ...], words: str) -> tuple[PersonTable, ...]:
    """The scene's people, or those that the words ask for."""
    if words == "":
        return people
    if words == NOBODY:
        return ()
    if not words.startswith(CLIP) or words == CLIP:
        raise WorldError(
            f"person = {words!r}; give 'none', or 'bvh:FILE' with '@X,Y' or '@X,Y,HEADING' after it"
        )
    file, _, where = words.removeprefix(CLIP).partition("@")
    at, heading = _place(people) if not where else _read(words, where)
    path = str(Path(file).absolute())
    return (PersonTable("person", clip=path, at_m=at, heading_deg=heading),)


def _place(people: tuple[PersonTable, ...]) -> tuple[tuple[float, float], float]:
    """Where the first person begins, and where that one looks [degrees]."""
    if not people:
        return ELSEWHERE, -90.0
    first = people[0]
    if first.at_m is not None:
        return first.at_m, first.heading_deg
    here, there = (first.stops * 2)[:2]
    x, y = np.subtract(there.at_m, here.at_m)
    return here.at_m, float(np.degrees(np.arctan2(y, x)))


def _read(words: str, where: str) -> tuple[tuple[float, float], float]:
    try:
        x, y, *heading = (float(x) for x in where.split(","))
        (turned,) = heading or [0.0]
    except ValueError as e:
        raise WorldError(
            f"person = {words!r}: {where!r} is no place; give X,Y or X,Y,HEADING"
        ) from e
    if not np.isfinite([x, y, turned]).all():
        raise WorldError(f"person = {words!r}: {where!r} is no place; give finite numbers")
    return (x, y), turned
