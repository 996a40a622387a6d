"""Why a sensor cannot tell what is before it."""

from enum import IntEnum


class Unable(IntEnum):
    """Why a sensor cannot tell what is before it: its space is unseen."""

    SEES = 0  # it can
    SILENT = 1
    FROZEN = 2  # repeats its values while it is moved
    BAD_STATUS = 3  # in a quarter of its zones or more
    COVERED = 4  # what is at its lens rides along with the arm
    DARK = 5  # returns nothing where something surely is
    TOUCHED = 6  # something is at its lens
    DIRTY_WINDOW = 7  # it can, but for what is thin and before an outline of the arm's own body

    @property
    def words(self) -> str:
        """For a person."""
        return self.name.lower().replace("_", " ")


# what is before these is seen, the one but for thin things before the arm's own outline
SEEING = (Unable.SEES, Unable.DIRTY_WINDOW)
