"""`flinch compare`: two recorded runs side by side."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.errors import RecordingError


@dataclass(frozen=True)
class Compare:
    """Put two recorded runs side by side: distances, time below the distance kept, stops, work,
    commands and their jerk. As they were recorded; nothing is computed anew."""

    a: tyro.conf.Positional[Path]
    """A recording, from `flinch run --record FILE.mcap`."""
    b: tyro.conf.Positional[Path]
    """Another one."""
    plot: Path | None = None
    """Draw distance, command and activation of both over time into this file (.svg, .png)."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.plot import check_plot
        from app.record.reader import open_recording
        from app.replay.summary import compared

        if self.plot is not None:
            check_plot(self.plot)
        names = (self.a.stem, self.b.stem)
        if names[0] == names[1]:
            names = (str(self.a), str(self.b))
        with open_recording(self.a) as a, open_recording(self.b) as b:
            for path, run in ((self.a, a), (self.b, b)):
                if not len(run):
                    raise RecordingError(f"{path}: holds no tick ({run.torn or 'it is empty'})")
            report = compared(a, b, names, self.plot)
        print(report.to_json() if self.json else report.to_text())
