"""A scene with what people have added to it, as the text of a scene's file."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.errors import WorldError
from app.messages import Array
from app.poses import turns
from app.text_file import as_text
from app.world.scene import read_scene


class Added(NamedTuple):
    """A body: its name, its shape as in a scene's file, and where it is, (4, 4)."""

    name: str
    shape: Mapping[str, Any]
    T_base_body: Array


def scene_text(path: Path, added: Sequence[Added]) -> str:
    """The scene at `path` with these bodies at its end.

    WorldError where it has files beside it, which the text would not find from elsewhere.
    """
    table = read_scene(path)
    meshes = any(hasattr(body.shape, "file") for body in table.body)
    if meshes or any(person.clip for person in table.person):
        raise WorldError(f"{path.name} has files beside it: copy its folder, and add bodies there")
    base = as_text(path, path.read_bytes(), WorldError).rstrip()
    return "\n".join([base, *map(_entry, added), ""])


def _entry(body: Added) -> str:
    # a number, a text and a list are written in TOML as in JSON
    shape = ", ".join(f"{key} = {json.dumps(value)}" for key, value in body.shape.items())
    place = np.round(body.T_base_body[:3, 3], 4).tolist()
    turned = np.round(np.degrees(turns(body.T_base_body)), 2).tolist()
    return (
        f"\n[[body]]\nname = {json.dumps(body.name, ensure_ascii=False)}\n"
        f"shape = {{ {shape} }}\nposition_m = {place}\nrpy_deg = {turned}"
    )
