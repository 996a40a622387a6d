"""The error budget: by how much the simulated world differs from what we believe of it.

A part has a strength: 1 is the size that a skin has which was glued on by hand, 0 switches it
off. What is drawn of one part does not depend on the others (see `app.sensing.truth`), so that
trials stay paired when one of them is switched off.
"""

from dataclasses import dataclass, fields, replace

from app.errors import ConfigError, options

MOST = 100.0  # strength beyond which a number was surely meant otherwise


@dataclass(frozen=True)
class Budget:
    """The strength of each part, and two facts beside them.

    mounting:    each sensor off by 2 mm and 0.5 degrees, 1 sigma a component.
    encoders:    joint angles read with a noise of 1e-4 rad.
    kinematics:  each joint's frame off by 0.5 mm and 0.05 degrees, 1 sigma a component.
    time:        stamps of frames off by 2 ms, 1 sigma.
    late_ms:     beside that, how much later than the light was sent a frame is stamped, always.
    zones:       a zone is an integral over its solid angle and reports the first strong pulse;
                 0: the rays and the merging rule that the self filter itself uses.
    sub:         rays in a row, and rows of them, that a zone is integrated with.
    reflectance: surfaces send back 0.05 to 0.9 of the light; 0: all of them a half.
    ranges:      noise grows as the returned signal falls.
    light:       ambient light of 0.5 klux.
    cover:       one window in ten is dirty and returns light itself.
    body:        links 1.5 mm, 1 sigma, off their meshes, and hoses on them that nobody modelled.
    """

    mounting: float = 1.0
    encoders: float = 1.0
    kinematics: float = 1.0
    time: float = 1.0
    late_ms: float = 0.0
    zones: float = 1.0
    sub: int = 5
    reflectance: float = 1.0
    ranges: float = 1.0
    light: float = 1.0
    cover: float = 1.0
    body: float = 1.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            low, high = FACTS.get(f.name, (0.0, MOST))
            if not low <= value <= high:
                raise ConfigError(f"world: {f.name} = {value:g}; give {low:g} to {high:g}")


FACTS = {"late_ms": (0.0, 200.0), "sub": (3, 15)}  # no strengths: least and most
HONEST = Budget()
IDEAL = replace(
    HONEST, **{f.name: 0.0 for f in fields(Budget) if f.name not in FACTS}  # type: ignore[arg-type]
)  # fmt: skip
WORLDS = {"honest": HONEST, "ideal": IDEAL}


def read_budget(text: str) -> Budget:
    """The budget of a text: a world's name, then single parts: 'honest,mounting=0,time=2'."""
    name, *parts = text.split(",")
    if name not in WORLDS:
        raise ConfigError(f"world = {text!r} begins with no world; {options(name, WORLDS)}")
    kinds = {f.name: int if f.name == "sub" else float for f in fields(Budget)}
    changes = {}
    for part in parts:
        key, _, value = part.partition("=")
        if key not in kinds:
            raise ConfigError(f"world = {text!r}: no part {key!r}; {options(key, kinds)}")
        try:
            changes[key] = kinds[key](value)
        except ValueError as e:
            raise ConfigError(f"world = {text!r}: {part!r}; give {key}=NUMBER") from e
    return replace(WORLDS[name], **changes)  # type: ignore[arg-type]
