"""A URDF and all that it needs, copied into a folder with paths that are relative to it."""

import re
import shutil
from pathlib import Path

from app.robot.meshes import Description

NAMES = re.compile(r"""(filename\s*=\s*)(["'])(.+?)\2""")
# what a mesh file names beside itself: materials of .obj, pictures of .mtl, .dae and .gltf
BESIDE = {
    ".obj": re.compile(r"^\s*mtllib\s+(.+?)\s*$", re.M),
    ".mtl": re.compile(r"^\s*(?:map_\w+|bump|disp|decal|refl)\s+(?:-\S+\s+\S+\s+)*(.+?)\s*$", re.M),
    ".dae": re.compile(r"<init_from>\s*([^<>]+?)\s*</init_from>"),
    ".gltf": re.compile(r'"uri"\s*:\s*"([^"]+)"'),
}


def copy_urdf(urdf: Path, description: Description, folder: Path) -> Path:
    """Copy `urdf` into `folder` and its meshes into `folder/meshes`; the new URDF.

    All but the meshes' names stays as it is, comments too.
    """
    taken: dict[Path, str] = {}

    def renamed(match: re.Match[str]) -> str:
        before, quote, name = match.groups()
        source = description.find(name)
        if source is None:
            return match.group(0)  # of a link that is not in use, or no mesh at all
        if source not in taken:
            taken[source] = _free(f"meshes/{source.parent.name}/{source.name}", taken)
            _copy(source, folder / taken[source], folder)
        return f"{before}{quote}{taken[source]}{quote}"

    out = folder / urdf.name
    out.write_text(NAMES.sub(renamed, urdf.read_text("utf-8")), "utf-8")
    return out


def _free(name: str, taken: dict[Path, str]) -> str:
    """The name, or one like it that no other file has."""
    path, n = Path(name), 2
    while name in taken.values():
        name = str(path.with_stem(f"{path.stem}-{n}"))
        n += 1
    return name


def _copy(source: Path, target: Path, folder: Path) -> None:
    """Copy a file and what it names beside itself, as long as that stays inside `folder`."""
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    names = BESIDE.get(source.suffix.lower())
    if names is None:
        return
    for name in names.findall(source.read_text("utf-8", errors="replace")):
        other, beside = source.parent / name, (target.parent / name).resolve()
        if other.is_file() and beside.is_relative_to(folder.resolve()) and not beside.exists():
            _copy(other, beside, folder)
