"""Where the command `flinch` begins: from here on Ctrl-C ends it, without a trace.

What is imported takes a second, and an interrupt in the middle of it would show wherever that is.
So until all is there the system ends the process itself.
"""

import signal


def main() -> int:
    """Entry point; exit code 130 after Ctrl-C, as a shell has it."""
    handler = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from app.cli import main as command

    signal.signal(signal.SIGINT, handler)
    try:
        return command()
    except KeyboardInterrupt:
        return 130
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # nor while the interpreter ends
