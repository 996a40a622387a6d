"""Is there somebody who would want a browser to open?"""

import os
import sys


def has_desktop() -> bool:
    """A screen that this process may open windows on; never where CI runs it."""
    if os.environ.get("CI"):
        return False
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY")
    )
