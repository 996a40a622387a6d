"""The entrance: where the page listens, how it is called from outside, what operating takes.

On this machine alone nothing is needed. Whatever lets other machines in, an address or a
proxy's public origin, demands an operator token; it comes from a file or the environment, since
a command line is seen by everybody on the machine. The way between is plain HTTP here: TLS is
the work of a proxy in front (static_assets/proxy).
"""

import ipaddress
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from app.errors import AccessError, ConfigError
from app.text_file import read_text

VARIABLE = "FLINCH_TOKEN"
SHORTEST = 16  # characters; 16 hexadecimal digits are 64 bits, hopeless at one try in a second
LONGEST = 256  # characters that a page may send as a text
HOW = f"put at least {SHORTEST} characters into a file (openssl rand -hex 16 > FILE)"


class Entrance(NamedTuple):
    """What the page needs to know of the way in."""

    host: str
    port: int  # 0: any free one
    token: str  # empty on one's own machine: every page may operate
    origins: tuple[str, ...]  # further addresses of the page, as of a proxy

    def words(self) -> list[str]:
        """What whoever starts the page should know."""
        out = []
        if self.token:
            out.append("Operating takes the token; whoever reaches the page may watch and stop.")
        if not _loopback(self.host):
            out.append("This is plain HTTP, the token too: TLS is the work of a proxy in front.")
        return out


def operator_token(
    host: str, origins: tuple[str, ...], file: Path | None, environment: Mapping[str, str]
) -> str:
    """The token for a page on `host` that is reached at `origins`; empty if none is needed.

    The file wins over the variable FLINCH_TOKEN. Raises `AccessError` where the page is open to
    other machines without a token, and where a token is too short.
    """
    token, source = environment.get(VARIABLE, "").strip(), VARIABLE
    if file is not None:
        source = str(file)
        try:
            token = read_text(file, AccessError).strip()
        except AccessError as e:
            raise AccessError(f"the token file {e}; {HOW}") from e
    named = file is not None or VARIABLE in environment
    where = beyond(host, origins)
    if where and not named:
        raise AccessError(
            f"{where} lets other machines in, which takes an operator token: {HOW} and give "
            f"--token-file FILE, or set {VARIABLE}"
        )
    if named and not (SHORTEST <= len(token) <= LONGEST and token.isprintable()):
        raise AccessError(
            f"the operator token in {source} is no line of {SHORTEST} to {LONGEST} characters "
            f"(it has {len(token)}); {HOW}"
        )
    return token


def beyond(host: str, origins: tuple[str, ...]) -> str:
    """What lets other machines in, as it was given on the command line; empty if nothing."""
    if not _loopback(host):
        return f"--host {host}"
    far = [o for o in origins if not _loopback(urlsplit(o).hostname or "")]
    return f"--origin {far[0]}" if far else ""


def checked_origin(text: str) -> str:
    """`text` as browsers write an origin. Raises `ConfigError` if it is none."""
    origin = text.lower().removesuffix("/")
    refusal = ConfigError(
        f"origin {text!r} is no address of a page; give it as https://cell.example or "
        "https://cell.example:8443, without a path"
    )
    try:
        parts = urlsplit(origin)
        port = parts.port  # raises for a port that is none, as urlsplit does for brackets
    except ValueError as e:
        raise refusal from e
    host = parts.hostname or ""
    name = f"[{host}]" if ":" in host else host
    usual = port in (None, 443 if parts.scheme == "https" else 80)  # browsers leave it out
    written = f"{parts.scheme}://{name}" if usual else f"{parts.scheme}://{name}:{port}"
    if (
        not host
        or parts.scheme not in ("http", "https")
        or origin not in (written, f"{written}:{port}")
    ):
        raise refusal
    return written


def _loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")
