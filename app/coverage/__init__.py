"""What a skin sees of the space around its arm, and what it cannot see.

Pure functions of a robot, a skin and a posture; no engine, no world. `patches` are the arm's
surface, `cones` the zones' views, `occlusion` what the arm itself hides of them, `first_seen`
when an approaching object is noticed, `volume` the space around the arm, `look` all of it at
one posture. `sites` are places for rings, `worth` what it is worth to see something coming,
`choosing` the best rings for a number of sensors. `beside` alone is a process: it looks while an
arm moves.
"""
