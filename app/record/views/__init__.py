"""A run as other viewers read it: Foxglove's well-known schemas, for Foxglove, Lichtblick, Rerun.

They pose the arm by frames and read meshes out of the stream itself, so that a file opens in any
of them with no description of the robot beside it. Nothing here is read back: a replay goes by
the recorded Inputs.
"""
