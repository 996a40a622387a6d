"""A skin on a pseudo terminal: its frames, its faults and the port."""
