"""A switch that a view offers to the legend or, where it has no sign there, to the view panel."""

from collections.abc import Callable
from typing import NamedTuple

from app.ui.colours import RGB


class Sign(NamedTuple):
    """What stands for it in the legend: a patch of its colour, or the rim of one."""

    colour: RGB
    hollow: bool = False


class Switch(NamedTuple):
    """`set` is called with what the person chose; `on` is how it starts."""

    label: str
    on: bool
    set: Callable[[bool], None]
    help: str = ""
    sign: Sign | None = None
