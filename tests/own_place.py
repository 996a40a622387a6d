"""A place that nobody shipped, as three TOML files."""

from pathlib import Path

SKIN = """title = "two rings on the upper arm"
[cover]

[[ring]]
name = "near"
link = "upper_arm_link"
centre_m = [-0.20, 0.0, 0.1762]
axis = [-1.0, 0.0, 0.0]
start = [0.0, 0.0, 1.0]
radius_m = 0.072
count = 10
tilt_deg = -30.0   # down to the bench

[[ring]]
name = "far"
link = "upper_arm_link"
centre_m = [-0.42, 0.0, 0.1762]
axis = [-1.0, 0.0, 0.0]
start = [0.0, 0.0, 1.0]
radius_m = 0.072
count = 10
"""
CELL = """title = "my bench"
[[box]]
name = "bench"
position_m = [0.0, 0.0, -0.05]
size_m = [2.0, 2.0, 0.1]

[[plane]]
name = "floor"
position_m = [0.0, 0.0, -0.8]
"""
# The upper arm stands almost upright at y = 0.176 m: the post is before it, below the forearm.
SCENE = """title = "a post beside the upper arm"
[[body]]
name = "bench"
shape = { kind = "box", size_m = [1.9, 1.9, 0.1] }
position_m = [0.0, 0.0, -0.05]

[[body]]
name = "post"
shape = { kind = "cylinder", radius_m = 0.05, length_m = 0.4 }
position_m = [0.17, 0.18, 0.45]
"""


def write_place(folder: Path) -> dict[str, str]:
    """Write the files into a folder; their paths by the flag that takes them."""
    out = {}
    for name, text in (("skin", SKIN), ("cell", CELL), ("scene", SCENE)):
        file = folder / f"my-{name}.toml"
        file.write_text(text)
        out[name] = str(file)
    return out
