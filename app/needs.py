"""What a controller wants of perception; `--help` reads it, so it takes no arrays."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Needs:
    """What a controller wants of perception.

    pairs: the closest of every link, several of every link, or that of every sensor's mount.
    reach: [m] up to where pairs are followed.
    as_published: as the paper perceives: one ray a zone, points behind the body stay, nothing is
                  remembered, doubted, steadied, held on to, known to move or to be unsure of.
    """

    pairs: Literal["links", "several", "mounts"]
    reach: float
    as_published: bool = False
