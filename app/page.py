"""Pages to keep: one file each, one style, and a policy that forbids them every request."""

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from app.errors import ConfigError

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
STYLE = """
:root { color-scheme: light dark; --ink: #1c2430; --soft: #6b7683; --paper: #fbfbfa;
  --line: #d8dce1; --warn: #b45309; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ee; --soft: #98a2ae; --paper: #14181e;
  --line: #343c47; --warn: #f0a44b; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
.soft { color: var(--soft); } .warn { color: var(--warn); }
figure { margin: 0; } figcaption { font-size: .85rem; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; }
th, td { padding: .2rem .6rem; text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
"""


class Html(str):
    """What is HTML already; any other text is escaped where it is put in."""


def html(value: object) -> Html:
    """A value as HTML."""
    return value if isinstance(value, Html) else Html(escape(str(value)))


def table(head: Sequence[object], rows: Iterable[Sequence[object]]) -> Html:
    """A table with a line of heads; cells are `Html` or text, a cell and its head are aligned."""
    top = "".join(f"<th>{html(word)}</th>" for word in head)
    body = "".join(f"<tr>{''.join(f'<td>{html(c)}</td>' for c in row)}</tr>" for row in rows)
    return Html(f'<div class="scroll"><table><tr>{top}</tr>{body}</table></div>')


def sheet(title: str, body: Html, style: str = "") -> str:
    """The whole page; style: what it adds to `STYLE`."""
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html(title)}</title>'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}{style}</style>'
        f"<h1>{html(title)}</h1>{body}</html>"
    )


def write_sheet(path: Path, text: str) -> None:
    """Write a page; ConfigError where that cannot be done."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as e:
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); give another file") from e
