"""What Ctrl-C does to a command.

An interrupt that is raised in Python is lost where a library catches all, as compilers do, and a
start then goes on for a minute. So as long as there is nothing to be ended in order, the system
ends the process itself; from then on whoever must be ended in order asks for that.
"""

import signal

NUMBERS = (signal.SIGINT, signal.SIGTERM)


def end_at_once() -> None:
    """From now on the system ends the process: nothing moves yet, nothing is being written."""
    for number in NUMBERS:
        signal.signal(number, signal.SIG_DFL)


def end_in_order() -> None:
    """From now on an interrupt is raised, so that what was begun is ended."""
    for number in NUMBERS:
        signal.signal(number, signal.default_int_handler)
