"""A run as a file: what entered each tick, and what other viewers make of it."""
