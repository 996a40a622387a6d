"""A switch that a view offers to the view panel."""

from collections.abc import Callable
from typing import NamedTuple


class Switch(NamedTuple):
    """`set` is called with what the person chose; `on` is how it starts."""

    label: str
    on: bool
    set: Callable[[bool], None]
    help: str = ""
