"""Where other viewers look in, and which web pages may."""

from typing import NamedTuple

from app.errors import ConfigError

VIEWERS_PORT = 8765  # what viewers offer at first
DESKTOP = "file://"  # the Origin of desktop viewers; no web page can bear it


class Window(NamedTuple):
    """A port of this machine, 0 for any free one, and the Origins of pages that may look."""

    port: int
    origins: tuple[str, ...]


def viewer_origin(text: str) -> str:
    """`text` as the Origin of a page that may look. Raises `ConfigError` if it is none."""
    scheme, mark, host = text.lower().removesuffix("/").partition("://")
    if not (mark and scheme.isalnum() and host and not set("/?#@ *\\") & set(host)):
        raise ConfigError(
            f"origin {text!r} is no address of a page; give it as https://app.foxglove.dev, "
            "without a path"
        )
    return f"{scheme}://{host}"
