"""The flag of a seed: a whole number from 0, refused in one line otherwise."""

from typing import Annotated

import tyro

from app.errors import ConfigError


def whole(text: str) -> int:
    """The seed that a person has given."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise ConfigError(f"seed = {text}; give a whole number from 0")
    return value


Seed = Annotated[
    int,
    tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar="INT",
        instance_from_str=lambda words: whole(words[0]),
        is_instance=lambda value: isinstance(value, int),
        str_from_instance=lambda value: [str(value)],
    ),
]
