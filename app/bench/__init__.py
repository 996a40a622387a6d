"""How fast, and beside what: this machine, each room of a tick, and other software."""
