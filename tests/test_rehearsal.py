"""No kernel is compiled, or fetched from disk, once an arm may move."""

import subprocess
import sys

CODE = """
from dataclasses import replace

from app.actions import AddObstacle, SetMode, SetParams
from app.compiled import kernels
from app.config import MODES
from app.messages import Mode
from app.rehearsal import SWITCHES, rehearse, turned
from app.timing import ManualClock
from app.setup import Setup
from app.wiring import build_engine

def versions():
    rooms = ("app.perception", "app.control", "app.robot")
    return {f"{k.__module__}.{k.__name__}": len(k.signatures) for k in kernels
            if k.__module__.startswith(rooms)}

engine = build_engine(Setup(scene="front-panel", rate=125.0), ManualClock())
rehearse(engine.robot, engine.skin, engine.cell, engine.brain.params)
before = versions()
base = engine.brain.params
def other(name):
    return {} if name == "mode" else {name: getattr(turned(base, name), name)}
found = {}
engine.post(AddObstacle("ball", {"kind": "sphere", "radius_m": 0.08}, (0.5, 0.35, 0.5)))
for mode in tuple(MODES):
    for name in ("mode", *SWITCHES):
        plain = {s: getattr(base, s) for s in SWITCHES}
        engine.post(SetParams(plain | {"mode": mode} | other(name)))
        if name == "memory":
            engine.post(SetMode(Mode.STOPPED))
        if name == "obstacle_speed":
            engine.post(SetMode(Mode.RUNNING))
        for _ in range(25):
            s = engine.step()
        new = {k: n for k, n in versions().items() if n != before[k]}
        if new:
            found[f"{mode} {name}"] = new
            before = versions()
        assert s.status.reason != "internal error", s.status
print(found, len(before) > 60, max(before.values()))
"""


def test_a_running_arm_needs_no_kernel_that_was_not_compiled_before_it_ran():
    """In every mode, with every switch turned, beside a plate and a ball."""
    out = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    assert out.stdout.strip() == "{} True 1"
