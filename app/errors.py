"""What can go wrong, said so that a person can mend it.

Every message is one line: the thing, what is wrong with it, and the remedy.
The command line prints the message alone and exits with a non-zero code.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class FlinchError(Exception):
    """Base of every error that a user can cause and mend."""


class ConfigError(FlinchError):
    """A setting, a TOML file or a command-line value that cannot be used."""


class RobotError(FlinchError):
    """A robot folder, its description, meshes or skin layout that cannot be used."""


class WorldError(FlinchError):
    """A scene file or an obstacle that cannot be used."""


class SensorError(FlinchError):
    """A sensor source (recording, port) that cannot be used."""


class RecordingError(FlinchError):
    """A recording of a run that cannot be written, read or understood."""


class StudyError(FlinchError):
    """A study that cannot be made here."""


class ServerError(FlinchError):
    """The page cannot be served (port taken, address refused)."""


class AccessError(FlinchError):
    """A page may not do what it asked for, or the page may not be opened to others."""


def options(name: str, known: Iterable[str]) -> str:
    """The tail of an error message: the nearest known name first, then all of them."""
    names = sorted(known)
    if not names:
        return "none is known here"
    near = get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{hint}known: {', '.join(names)}"
