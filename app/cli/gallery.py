"""`flinch gallery`: an index of exported pages; and the paper's scenes, if they are asked for."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.cli.export import write
from app.errors import ConfigError


@dataclass(frozen=True)
class Gallery:
    """Write DIR/index.html: a picture, length, smallest distances and a link of each page there."""

    folder: tyro.conf.Positional[Path]
    """The folder with pages from `flinch export`."""
    paper: bool = False
    """Record and export the paper's scenes into it first, SM, WB and QP side by side: minutes."""
    share: float = 1.0
    """Of the paper's scenes, this share of their length, 0 to 1."""

    def __post_init__(self) -> None:
        if not 0.0 < self.share <= 1.0:
            raise ConfigError(f"share = {self.share:g}; give a part of 1")

    def __call__(self) -> None:
        from app.ui.export.gallery import INDEX, write_index

        if self.paper:
            self._paper()
        count = write_index(self.folder)
        print(f"{self.folder / INDEX}: {count} {'page' if count == 1 else 'pages'}")

    def _paper(self) -> None:
        from app.studies.paper_scenes import SCENES, record_scene
        from app.ui.export.export import Part
        from app.ui.export.recorded import page_from

        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise ConfigError(f"{self.folder}: cannot be made ({e.strerror})") from e
        for scene in SCENES:
            paths = []
            for path in record_scene(scene, self.folder, self.share):
                print(f"{path}: recorded", flush=True)
                paths.append(path)
            write(page_from(paths, Part()), self.folder / f"{scene.name}.html")
