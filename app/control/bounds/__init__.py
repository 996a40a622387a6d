"""Bounds on the joint velocities: one kind a file, each with one method, on one sheet of rows."""
