"""The brain that made a recording, as it was before the first recorded tick."""

from app.brain import Brain
from app.choices import build_robot, choose_skin, limited
from app.record.head import Head


def brain_of(head: Head, like: Brain | None = None) -> Brain:
    """Robot, skin, cell, settings and errand of the recording's head; with its state, if it began
    in the middle of a run.

    like: another brain of the same head, whose robot and skin need not be loaded again.

    Raises the FlinchError of whatever the head names that is not here any more: a robot's folder,
    a layout, a table of ranges or of mounts.
    """
    if like is None:
        robot = build_robot(head.setup)
        skin, robot = choose_skin(head.setup, robot), limited(robot, head.limits)
    else:
        robot, skin = like.robot, like.skin
    brain = Brain(
        robot, skin, head.cell, head.params,
        goal=head.goal, programs=head.programs, begin=head.begin,
    )  # fmt: skip
    if head.state is not None:
        brain.restore(brain.read(head.state))
    return brain
