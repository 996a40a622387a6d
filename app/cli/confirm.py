"""The question at the console before a real arm may be moved."""

import sys
from collections.abc import Callable

from app.errors import ConfigError

WARNING = """
Flinch is about to move the real arm at {host}.
  It is research software and no safety function: it is not rated, and it may fail.
  Keep the emergency stop in your hand, people out of reach, and the speed low at first.
  The arm gives way as soon as the sensors speak ({sensors}).{blind}
"""
BLIND = """
  THESE SENSORS ARE NOT ON THE ARM: it will see nobody who stands beside it."""

PARTLY = """
  SOME OF THESE SENSORS ARE NOT ON THE ARM: where they should be, it sees nobody."""


def confirm(driver: str, sensors: str, ask: Callable[[str], str] | None = None) -> None:
    """Have a person type the arm's address; ConfigError, and nothing has begun, otherwise.

    `ask` stands in for the terminal, which it must be without: no pipe and no service can say yes.
    """
    host = driver.partition(":")[2]
    if ask is None:
        if not sys.stdin.isatty():
            raise ConfigError("--arm asks a person; start it at a terminal")
        ask = input
    real, simulated, _ = sensors.partition("+simulated")
    blind = (PARTLY if simulated else "") if real.startswith("serial") else BLIND
    print(WARNING.format(host=host, sensors=sensors, blind=blind), flush=True)
    try:
        typed = ask(f"Type the arm's address ({host}) to go on: ")
    except EOFError:
        typed = ""
    if not host or typed.strip() != host:
        raise ConfigError(f"{typed.strip()!r} is not {host!r}; nothing was sent to the arm")
