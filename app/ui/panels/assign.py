"""Assigning a control's value from the arm's side."""

from typing import Any

import viser


def assign(control: viser.GuiInputHandle[Any], value: Any) -> None:
    """Show `value`; nothing is sent if it is shown already.

    viser runs the control's callbacks for this too, with `client_id` None, so that callbacks
    that post an action must look at it first.
    """
    control.value = value  # type: ignore[misc]  # mypy misses the setter, which stands apart
