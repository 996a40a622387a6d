"""Where the folders `robots` and `static_assets` are: beside the package, or inside the wheel."""

from pathlib import Path

from app.errors import ConfigError, FlinchError, options

_PACKAGE = Path(__file__).parent


def asset_folder(name: str) -> Path:
    """The folder `robots` or `static_assets` of a checkout, else of the installed wheel."""
    for folder in (_PACKAGE.parent / name, _PACKAGE / "_data" / name):
        if folder.is_dir():
            return folder
    raise ConfigError(f"the folder {name!r} is missing from this installation; install it again")


def find_asset(name: str, folder: Path, suffix: str, error: type[FlinchError]) -> Path:
    """A path as given if it exists, else `folder/name` with `suffix`; unknown names are told."""
    given = Path(name)
    if given.exists() and (given.suffix == suffix or (not suffix and given.is_dir())):
        return given
    inside = folder / f"{name}{suffix}"
    if inside.exists():
        return inside
    known = [p.stem if suffix else p.name for p in folder.glob(f"*{suffix}") if _fits(p, suffix)]
    raise error(f"{name!r} is neither a path nor a name in {folder.name}/; {options(name, known)}")


def _fits(path: Path, suffix: str) -> bool:
    return path.is_file() if suffix else path.is_dir()
