"""The one form of every `--json`: what, machine, versions, seed, rows, checks."""

import json
import math
import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from app import __version__

PACKAGES = ("numpy", "pin", "embreex", "numba", "daqp", "proxsuite", "trimesh", "viser", "yourdfpy")


@dataclass(frozen=True)
class Check:
    """A measured value beside its limit; `at_least` says on which side it should lie."""

    name: str
    value: float
    unit: str
    limit: float
    at_least: bool = False

    @property
    def ok(self) -> bool:
        """Is the value on the right side? NaN never is."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit


@dataclass(frozen=True)
class Report:
    """Rows of figures and checks of one command."""

    what: str
    seed: int
    rows: list[dict[str, Any]]
    checks: list[Check] = field(default_factory=list)

    def to_json(self) -> str:
        """One object, strict JSON: what is not finite becomes null."""
        content = {
            "what": self.what,
            "machine": machine(),
            "versions": versions(),
            "seed": self.seed,
            "rows": self.rows,
            "checks": [
                {"name": c.name, "value": c.value, "unit": c.unit, "limit": c.limit, "ok": c.ok}
                for c in self.checks
            ],
        }
        return json.dumps(_finite(content), indent=2, allow_nan=False)

    def to_text(self) -> str:
        """The same for a person."""
        lines = [self.what]
        for row in self.rows:
            rest = "  ".join(f"{k} {_show(v)}" for k, v in row.items() if k != "name")
            lines.append(f"  {row['name']:<22} {rest}")
        for c in self.checks:
            side = ">=" if c.at_least else "<="
            verdict = "ok" if c.ok else "MISSED"
            lines.append(f"  {c.name:<46} {c.value:.4g} {c.unit} ({side} {c.limit:g}) {verdict}")
        return "\n".join(lines)


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    return {
        "system": platform.system(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def versions() -> dict[str, str]:
    """Flinch and the packages that the figures depend on."""
    found = {"flinch": __version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as f:
            names = [line.split(":", 1)[1].strip() for line in f if line.startswith("model name")]
        return names[0] if names else platform.processor()
    except OSError:  # not a Linux machine
        return platform.processor()


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def _show(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
