"""A page in a process of its own, which a test may stop, continue and end as it likes.

    python -m tests.lonely_page

Prints the address, then every mode that is asked for.
"""

import time

from app.actions import SetMode
from app.robot.model import find_robot, load_robot
from app.ui.page import Page
from tests.ui_page import FakeEngine, fake_skin, snapshot

PERIOD = 0.05  # [s] between two snapshots


def main() -> None:
    robot = load_robot(find_robot("ur10e"))
    engine, told = FakeEngine(robot, fake_skin(robot)), 0
    with Page(engine, port=0) as page:
        for view in (page.robot, page.stage, page.goal):  # an empty scene is drawn in no time
            for switch in view.switches():
                switch.set(False)
        page.server.scene.configure_environment_map(None)
        print(page.url, flush=True)
        while True:
            now = snapshot(engine)
            engine.snapshots.put(now, now.stamp)
            for action in engine.posted[told:]:
                if isinstance(action, SetMode):
                    print(action.mode.value, flush=True)
            told = len(engine.posted)
            time.sleep(PERIOD)


if __name__ == "__main__":
    main()
