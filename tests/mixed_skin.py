"""A skin of three types of sensors, two of them nowhere but in these texts.

All look out of the forearm in the same direction, side by side: an 8x8 one that ships, one of
16x16 zones that reports the length of its rays in a view that is wider than high, and one of a
single zone. Whoever writes a judge of them takes the numbers from here, not from the app.
"""

WIDE = """
title = "wide, 16x16 zones, radial"
rows = 16
columns = 16
field_of_view_deg = [60.0, 40.0]
range = "radial"
least_m = 0.03
most_m = 3.0
rate_hz = 20.0
pulse_m = 0.05
pulse_share = 0.1
separate_m = 0.5
footprint = 1

[status]
valid = 1
merged = 2
no_target = 0
trusted = [1, 2]

[error]
noise_floor_m = 0.002
noise_share = 0.004

[detection]
white = { reflectance = 0.9, dark_m = 3.0, bright_m = 1.5 }
grey = { reflectance = 0.2, dark_m = 2.0, bright_m = 1.0 }
bright_klux = 10.0
"""

POINT = """
title = "point, one zone"
rows = 1
columns = 1
field_of_view_deg = [10.0, 10.0]
range = "perpendicular"
least_m = 0.04
most_m = 2.5
rate_hz = 30.0
pulse_m = 0.05
pulse_share = 0.1
separate_m = 0.5
footprint = 5

[status]
valid = 0
no_target = 255
trusted = [0]

[error]
noise_floor_m = 0.003
noise_share = 0.004

[detection]
white = { reflectance = 0.9, dark_m = 2.5, bright_m = 1.5 }
grey = { reflectance = 0.2, dark_m = 1.5, bright_m = 1.0 }
bright_klux = 10.0
"""

LENS = (-0.235, 0.072, 0.0393)  # [m] of the middle one, forearm_link, 30 mm outside of the tube
SHIFT = {"eight": 0.0, "wide": -0.02, "point": 0.02}  # [m] along x
LAYOUT = "".join(
    f"""
[[sensor]]
name = "{name}"
type = "{kind}"
link = "forearm_link"
position_m = [{LENS[0] + SHIFT[name]}, {LENS[1]}, {LENS[2]}]
direction = [0.0, 1.0, 0.0]
up = [1.0, 0.0, 0.0]
"""
    for name, kind in (("eight", "vl53l8cx"), ("wide", "wide.toml"), ("point", "point.toml"))
)
# by name: rows, columns, view across and down [deg]
SHAPES = {"eight": (8, 8, 45.0, 45.0), "wide": (16, 16, 60.0, 40.0), "point": (1, 1, 10.0, 10.0)}
NOISE = {"eight": (0.0007, 0.0065), "wide": (0.002, 0.004), "point": (0.003, 0.004)}


def write(folder):
    """The layout and its types as files; the layout's path."""
    (folder / "wide.toml").write_text(WIDE)
    (folder / "point.toml").write_text(POINT)
    layout = folder / "mixed.toml"
    layout.write_text('title = "three kinds of sensors"\n' + LAYOUT)
    return layout
