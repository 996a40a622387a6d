"""Is the robot, and is its skin, as its files say? What is measured of them goes into files."""
