"""Nothing of the pipeline compiles once an arm may move."""

import subprocess
import sys

CODE = """
import sys
from numba.core.dispatcher import Dispatcher
from app.rehearsal import rehearse
from app.timing import ManualClock
from app.wiring import Setup, build_engine

def kernels():
    modules = [m for name, m in sys.modules.items() if name.startswith(ROOMS)]
    found = {id(v): v for m in modules for v in vars(m).values() if isinstance(v, Dispatcher)}
    return {f"{v.__module__}.{v.__name__}": len(v.signatures) for v in found.values()}

ROOMS = ("app.perception", "app.control", "app.robot")
engine = build_engine(Setup(scene="cell", rate=250.0), ManualClock())
rehearse(engine.robot, engine.skin, engine.cell, engine.brain.params)
before = kernels()
for _ in range(250):
    engine.step()
print({name: n for name, n in kernels().items() if n != before.get(name)}, len(before) > 20)
"""


def test_a_running_arm_needs_no_kernel_that_was_not_compiled_before_it_ran():
    out = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "{} True"
