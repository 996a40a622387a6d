"""The benchmark's tables: Markdown for a README, CSV and JSON for programs, a page for readers."""

import csv
import io
import json
from collections.abc import Sequence
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any

from app.assets import asset_folder
from app.errors import ConfigError
from app.report import machine, versions
from app.studies.benchmark.table import COLUMNS, Column

Rows = Sequence[dict[str, Any]]
FAIR = (
    "Every controller is given the same frames in the same trials, the same self filter, memory "
    "and near pairs, the same goal and the same limits of speed, and is kept out of the known "
    "cell. A guest's command is cut to the limits of position, velocity and acceleration; `cut` "
    "tells how often. Not equal: `paper` and `sm` are run without memory, as published; `paper` "
    "perceives as published; the oracle perceives the truth, which no sensor tells; `jumps` are "
    "known of a guest only where it tells which pair it acts on. Distances and contacts are "
    "those of the simulated world, not those perceived."
)


def show(row: dict[str, Any], c: Column) -> str:
    """A value with its interval, as text; a dash where it is not known."""
    if c.key not in row:
        return "-"
    text = f"{row[c.key]:.{c.digits}f}"
    if f"{c.key}_low" in row:
        text += f" [{row[f'{c.key}_low']:.{c.digits}f}, {row[f'{c.key}_high']:.{c.digits}f}]"
    return text


def markdown(title: str, rows: Rows, faults: Rows) -> str:
    """Everything, a table a set."""
    parts = [f"# {title}", FAIR]
    for name, group in groupby(rows, key=lambda r: r["set"]):
        parts += [f"## {name}", _table(list(group))]
    if faults:
        parts += ["## Trials that died", "\n".join(f"- {_fault(f)}" for f in faults)]
    parts += ["## Columns", "\n".join(f"- {c.title}: {c.about}" for c in COLUMNS)]
    return "\n\n".join(parts) + "\n"


def _fault(f: dict[str, Any]) -> str:
    return f"{f['controller']}, {f['set']}, seed {f['seed']}: {f['why']}"


def _used(rows: Rows) -> list[Column]:
    return [c for c in COLUMNS if any(c.key in r for r in rows)]


def _table(rows: Rows) -> str:
    columns = _used(rows)
    lines = [
        "| controller | trials | " + " | ".join(c.title for c in columns) + " |",
        "|---|---|" + "---|" * len(columns),
    ]
    for r in rows:
        cells = " | ".join(show(r, c) for c in columns)
        lines.append(f"| {r['controller']} | {r['trials']} | {cells} |")
    return "\n".join(lines)


def as_csv(rows: Rows) -> str:
    """A line a row, every figure a column."""
    keys = ["set", "controller", "trials"]
    for c in COLUMNS:
        keys += [k for k in (c.key, f"{c.key}_low", f"{c.key}_high") if any(k in r for r in rows)]
    out = io.StringIO()
    writer = csv.DictWriter(out, keys, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def as_json(title: str, rows: Rows, faults: Rows) -> str:
    """One object, with what it was made on."""
    content = {
        "what": title, "machine": machine(), "versions": versions(), "rows": rows,
        "faults": faults, "columns": {c.key: c.about for c in COLUMNS},
    }  # fmt: skip
    return json.dumps(content, indent=2, allow_nan=False)


def as_page(title: str, rows: Rows, faults: Rows, gallery: str = "") -> str:
    """The same for a reader; `gallery`: address of the clips, empty: there are none."""
    parts = [f"<p>{escape(FAIR)}</p>"]
    if gallery:
        parts.append(f'<p><a href="{escape(gallery)}">Clips of every set, side by side</a></p>')
    for name, group in groupby(rows, key=lambda r: r["set"]):
        own = list(group)
        columns = _used(own)
        head = "".join(f'<th title="{escape(c.about)}">{escape(c.title)}</th>' for c in columns)
        body = "".join(
            f"<tr><th>{escape(r['controller'])}</th><td>{r['trials']}</td>"
            + "".join(f"<td>{escape(show(r, c))}</td>" for c in columns) + "</tr>"
            for r in own
        )  # fmt: skip
        parts.append(
            f"<h2>{escape(name)}</h2><div><table><tr><th>controller</th><th>trials</th>{head}</tr>"
            f"{body}</table></div>"
        )
    if faults:
        items = "".join(f"<li>{escape(_fault(f))}</li>" for f in faults)
        parts.append(f"<h2>Trials that died</h2><ul>{items}</ul>")
    page = (asset_folder("static_assets") / "benchmark" / "table.html").read_text("utf-8")
    return page.replace("<!--title-->", escape(title)).replace("<!--tables-->", "\n".join(parts))


def write_tables(folder: Path, title: str, rows: Rows, faults: Rows, gallery: str = "") -> None:
    """benchmark.md, .csv, .json and index.html in a folder; ConfigError where that cannot be."""
    texts = {
        "benchmark.md": markdown(title, rows, faults), "benchmark.csv": as_csv(rows),
        "benchmark.json": as_json(title, rows, faults),
        "index.html": as_page(title, rows, faults, gallery),
    }  # fmt: skip
    try:
        for name, text in texts.items():
            (folder / name).write_text(text, "utf-8")
    except OSError as e:
        raise ConfigError(f"{folder}: cannot be written ({e.strerror}); try another place") from e
