"""A file that describes how a sketch prints its frames: `PORT#mine.toml`.

    lines = "rows"             # or "columns": what one printed line is, as the sensor sees it
    columns = "from left"      # or "from right", as the sensor sees it
    rows = "from top"          # or "from bottom"
    unit = "mm"                # or "cm", "m"
    status = "none"            # or "beside" (412 (5), 412:5), "alternate" (412 5 409 5),
                               # "after" (all distances, then all statuses: line or second grid)
    valid = [5, 9]             # optional: statuses of a good distance
    skip = 0                   # optional: numbers at the beginning of a line that are no zones

    [sensors]                  # optional: which sensor the frames under a heading are of
    "Left:" = "ring1-01"

The first five have no default: nothing of them can be seen in the numbers.
"""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, field

from app.errors import SensorError
from app.sensing.wire.described import Print, Status
from app.sensing.wire.raw import NO_TARGET
from app.sensing.wire.reader import UNITS
from app.toml import Table, read_toml

Code = Annotated[int, Meta(ge=0, lt=NO_TARGET)]
MOST = 16  # numbers of a line that are no zones


class File(Table, frozen=True):
    """What stands in such a file."""

    lines: Literal["rows", "columns"]
    columns: Literal["from left", "from right"]
    rows: Literal["from top", "from bottom"]
    unit: Literal["mm", "cm", "m"]
    status: Literal["none", "beside", "alternate", "after"]
    valid: tuple[Code, ...] = (5, 9)
    skip: Annotated[int, Meta(ge=0, le=MOST)] = 0
    sensors: dict[str, str] = field(default_factory=dict)


def read_print(path: Path) -> tuple[Print, tuple[str, ...]]:
    """What a file describes, and the sensors' names in the order of its headings."""
    told = read_toml(path, File, SensorError)
    if not told.valid:
        raise SensorError(f"{path}: valid is empty; give the statuses of a good distance")
    headings = tuple(told.sensors)
    for one in headings:
        inside = [other for other in headings if one in other and one != other]
        if inside or not one.strip():
            raise SensorError(
                f"{path}: sensors: heading {one!r} also stands in {inside or ['every line']}; "
                "give headings that tell the sensors apart"
            )
    how = Print(
        columns=told.lines == "columns",
        from_right=told.columns == "from right",
        from_bottom=told.rows == "from bottom",
        unit=UNITS[told.unit],
        status=Status(told.status),
        valid=told.valid,
        skip=told.skip,
        sensors=headings,
    )
    return how, tuple(told.sensors.values())
