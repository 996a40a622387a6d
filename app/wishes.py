"""What people ask for, done one after another at the head of a tick.

A browser may send anything: what fails is a notice to a person, no more.
"""

from app import actions as asked
from app.config import Params, change
from app.control.controllers import Controllers
from app.control.errand import Errand
from app.errors import FlinchError
from app.guard import Guard
from app.messages import NO_NOTICE, Array, Mode, Notice
from app.perception.perceiver import Perceiver
from app.tick import Inputs

BY_HAND = (asked.Jog, asked.JogJoints, asked.Want)
STANDS = "the arm stands still: press Run or Hold before it is moved by hand"
NOTHING_STILL = "nothing stood still where the skin looks: nothing was learned"


class Wishes:
    """The settings, the errand and the last notice; `heed` changes them, and what they concern."""

    def __init__(self, params: Params, errand: Errand) -> None:
        self.params, self.errand, self.notice = params, errand, NO_NOTICE

    def heed(
        self,
        x: Inputs,
        T_base_tool: Array,
        guard: Guard,
        perception: Perceiver,
        controllers: Controllers,
    ) -> bool:
        """Do what was asked for; was motion asked for?"""
        engage = False
        for action in x.actions:
            if not isinstance(action, BY_HAND):
                self.notice = NO_NOTICE  # they come twenty times a second
            try:
                match action:
                    case (
                        asked.SetGoal() | asked.SetPose() | asked.GoHome()
                        | asked.RunProgram() | asked.RunTaught()
                    ):  # fmt: skip
                        self.errand.take(action, T_base_tool)
                    case asked.Jog() | asked.JogJoints() | asked.Want():
                        self._move_by_hand(action, x.now, guard)
                    case asked.SetParams(changes=changes):
                        self.params = change(self.params, changes)
                    case asked.SetMode(mode=mode, reason=reason):
                        engage |= self._set_mode(
                            Mode(mode), reason, x.now, T_base_tool, guard, perception
                        )
                    case asked.Remark(words=words, refused=refused):
                        self.notice = Notice(words, refused)
                    case _ if not isinstance(action, asked.OF_THE_PLANT):
                        words = _change_background(action, x.now, perception, controllers)
                        self.notice = Notice(words)
            except Exception as error:
                known = isinstance(error, FlinchError | ValueError)
                words = str(error) if known else f"{type(action).__name__} failed: {error!r}"
                self.notice = Notice(words, refused=True)
        if x.refused:
            self.notice = Notice(x.refused, refused=True)
        if perception.background.finish(x.now):
            count = len(perception.background.preview)
            words = f"{count} cubes learned: keep or discard them" if count else NOTHING_STILL
            self.notice = Notice(words)
        return engage

    def _move_by_hand(
        self, action: asked.Jog | asked.JogJoints | asked.Want, now: float, guard: Guard
    ) -> None:  # fmt: skip
        """Only an arm that may move; it holds from then on, where it is left."""
        if guard.mode not in (Mode.RUNNING, Mode.HOLDING):
            raise ValueError(STANDS)
        self.errand.jog(action, now)
        if self.notice.refused:
            self.notice = NO_NOTICE  # what was refused before is done now
        if guard.mode is Mode.RUNNING and self.errand.by_hand:
            guard.ask(Mode.HOLDING, action.reason, now)

    def _set_mode(
        self, mode: Mode, reason: str, now: float, T_base_tool: Array, guard: Guard,
        perception: Perceiver,
    ) -> bool:  # fmt: skip
        self.errand.leave_alone()
        if mode is Mode.HOLDING:
            self.errand.hold(T_base_tool)
        if guard.mode is Mode.STOPPED and mode is not Mode.STOPPED:
            perception.begin_anew()
        guard.ask(mode, reason, now)
        return mode is not Mode.STOPPED


def _change_background(
    action: asked.Action, now: float, perception: Perceiver, controllers: Controllers
) -> str:
    """Learn, keep, discard or forget; what hides from perception bounds motion at once.

    Returns what a person should be told of it.
    """
    background = perception.background
    match action:
        case asked.LearnBackground(seconds=seconds):
            background.learn(now, seconds)
        case asked.KeepBackground():
            background.keep()
        case asked.DiscardBackground():
            background.discard()
        case asked.ForgetBackground():
            background.forget()
        case _:
            raise ValueError(f"{action!r} is nothing that can be asked for")
    if isinstance(action, asked.KeepBackground | asked.ForgetBackground):
        perception.know(background.known)
        controllers.know(background.known)
        return f"{len(background.known)} learned cubes are known from now on"
    return ""
