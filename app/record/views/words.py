"""What people are told, as a log: stops, changes of the mode, answers to their actions."""

from foxglove_schemas_protobuf.Log_pb2 import Log

from app.messages import NO_NOTICE, Mode, Notice, Snapshot, Status
from app.record.views.values import View, time_of


class LogView:
    """`/log`, when something has changed."""

    def __init__(self) -> None:
        self._status: Status | None = None
        self._notice: Notice = NO_NOTICE
        self._advice = ""

    def of(self, s: Snapshot, at_ns: int) -> list[View]:
        """What is new since the last call; nothing in most ticks."""
        out: list[View] = []
        status = s.status
        if status is not self._status and status != self._status:
            stopped = status.mode is Mode.STOPPED
            words = f"{status.mode}: {status.reason}" if status.reason else str(status.mode)
            out.append(_log(words, Log.ERROR if stopped else Log.INFO, at_ns))
        self._status = status
        if s.notice is not self._notice and s.notice != self._notice and s.notice.words:
            level = Log.WARNING if s.notice.refused else Log.INFO
            out.append(_log(s.notice.words, level, at_ns))
        self._notice = s.notice
        if s.advice != self._advice and s.advice:
            out.append(_log(s.advice, Log.INFO, at_ns))
        self._advice = s.advice
        return out


def _log(words: str, level: Log.Level.ValueType, at_ns: int) -> View:
    return "/log", Log(timestamp=time_of(at_ns), level=level, message=words, name="flinch")
