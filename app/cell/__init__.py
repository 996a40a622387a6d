"""The cell: what stands at the place for good, whether it is simulated, real or recorded."""
