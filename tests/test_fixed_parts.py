"""Parts that are fixed to a sensor's link somewhere else than at its frame."""

import numpy as np

from app.messages import Verdict
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine

URDF = """<robot name="two"><link name="base"><collision><geometry><box size="0.1 0.1 0.1"/>
</geometry></collision></link><link name="arm"><collision><origin xyz="0 0 0.2"/><geometry>
<cylinder radius="0.04" length="0.3"/></geometry></collision></link><link name="plate"><collision>
<geometry><box size="0.9 0.9 0.02"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="f" type="fixed"><parent link="arm"/><child link="plate"/><origin xyz="0 0 0.4"
 rpy="0.6 0 0"/></joint></robot>"""
SKIN = """title = "one sensor that looks at a plate"
[[sensor]]
name = "eye"
link = "arm"
position_m = [0.06, 0.0, 0.2]
direction = [0.5, 0.0, 1.0]
up = [1.0, 0.0, 0.0]
"""


def test_a_plate_that_is_fixed_at_an_angle_is_told_from_obstacles(tmp_path):
    (tmp_path / "two.urdf").write_text(URDF)
    (tmp_path / "skin.toml").write_text(SKIN)
    setup = Setup(urdf=str(tmp_path / "two.urdf"), skin=str(tmp_path / "skin.toml"), scene="empty")
    engine = build_engine(setup, ManualClock())
    verdicts = [engine.step().cloud.verdict for _ in range(100)]
    engine.close()
    seen = np.bincount(np.concatenate(verdicts[-20:]), minlength=len(Verdict))
    assert seen[Verdict.SELF] > 20 * 8
    assert seen[Verdict.KEPT] == seen[Verdict.BEHIND] == 0
