"""A virtual UR controller: the same three ports as the real one, and a simulated arm behind.

    29999 dashboard.py ─┐
    30003 server.py  ───┼─► controller.py (modes, registers, faults) ─► joints.py (the arm)
    30004 wire.py    ───┘          └─ program.py (what the uploaded program does)

It is for trying things out, and not a model of the maker's controller in anything but what
`ur-rtde` needs of it: to connect, to read states, to move by joint velocities, to be refused.
"""
