"""By which rules frames are judged and believed."""

from typing import NamedTuple

from app.config import Params


class Rules(NamedTuple):
    """What perception does beyond the paper; `PUBLISHED` does nothing of it.

    footprint:      many rays a zone before the self filter, for a zone is a cone and its
                    mounting is in doubt; else one.
    two_sided:      points behind the body stay, as the paper's Algorithm 1 has it.
    doubts_ghosts:  a nearer point waits for a second frame or zone.
    memory:         what left the field of view is remembered.
    obstacle_speed: how fast things come nearer is measured.
    feels_contact:  what is nearer than a sensor can measure is at its lens.
    doubts_hoses:   what lies within the box round a link and nowhere else hangs on it.
    doubts_mixtures: what is small, before the known cell and at the arm's outline is both of them.
    doubts_windows: what is thin and before an outline of the body waits, behind a dirty window for
                    ever.
    """

    footprint: bool = True
    two_sided: bool = False
    doubts_ghosts: bool = True
    memory: bool = True
    obstacle_speed: bool = True
    feels_contact: bool = True
    doubts_hoses: bool = True
    doubts_mixtures: bool = True
    doubts_windows: bool = True


PUBLISHED = Rules(False, True, False, False, False, False, False, False, False)


def rules_of(params: Params, as_published: bool) -> Rules:
    """Those of the settings, or the paper's."""
    if as_published:
        return PUBLISHED
    return Rules(memory=params.memory, obstacle_speed=params.obstacle_speed)
