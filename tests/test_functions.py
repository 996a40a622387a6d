"""A function fits a screen, and its arguments a line: what is longer holds more than one idea."""

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent
LINES, ARGUMENTS = 60, 8


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """How many there are, without what a method belongs to."""
    a = function.args
    names = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg) if x]
    return len([n for n in names if n not in ("self", "cls")])


def too_large() -> set[str]:
    """Functions of the product with too many lines or arguments, by file."""
    found = set()
    for path in (ROOT / "app").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            lines = (node.end_lineno or 0) - node.lineno + 1
            if lines > LINES or arguments(node) > ARGUMENTS:
                found.add(f"{path.relative_to(ROOT)}: {node.name}")
    return found


def test_no_function_is_too_long_or_takes_too_many_arguments() -> None:
    assert too_large() == set()
