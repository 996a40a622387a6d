"""Keeps what is learned of the cell in its file: in a thread of its own, as slowly as a disk is."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from app.actions import Action, Remark
from app.cell.files import save_learned
from app.cell.learned import Learned, cubes_at
from app.errors import FlinchError
from app.messages import Array
from app.tick import Tick


class Keeper:
    """Follows an engine and writes `path` whenever what is known of the background changes."""

    def __init__(self, path: Path, post: Callable[[Action], None]) -> None:
        self._path, self._post = path, post
        self._known: Array | None = None
        self._pool = ThreadPoolExecutor(1, "flinch-keeper")

    def put(self, tick: Tick) -> None:
        """Look at a tick; what is known at the first one is in the file already."""
        known = tick[1].background.known
        if self._known is not None and known is not self._known:
            self._pool.submit(self._save, Learned.of(cubes_at(known)))
        self._known = known

    def close(self) -> None:
        """Wait until all is written."""
        self._pool.shutdown()

    def _save(self, learned: Learned) -> None:
        try:
            save_learned(self._path, learned)
        except FlinchError as error:
            self._post(Remark(str(error), refused=True))
        else:
            self._post(Remark(f"{len(learned)} learned cubes are kept in {self._path}"))
