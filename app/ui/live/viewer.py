"""One viewer that is connected: what it wants, what waits for it, what it may not.

Nothing waits for a viewer. Of each topic the newest message waits for it, of the log some; what
comes meanwhile takes the place of what it had no time for.
"""

import asyncio
from collections.abc import Mapping
from contextlib import suppress

import msgspec
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from app.timing import Clock
from app.ui.live.protocol import Subscribe, Unsubscribe, message_data, read_wish, refusal
from app.ui.paced_log import PacedLog
from app.ui.pacing import Bucket

WISHES, WISHES_BURST = 50.0, 200.0  # [1/s] messages of one viewer
LOG_ROOM = 64  # lines of the log that wait
LOG_TOPIC = "/log"

Newest = Mapping[str, tuple[int, bytes]]  # by topic: time [ns] and message


class Viewer:
    """Lives as long as its connection; all on the loop of the sockets."""

    def __init__(
        self, socket: ServerConnection, channels: Mapping[str, int], clock: Clock, log: PacedLog
    ) -> None:
        self._socket, self._clock, self._log = socket, clock, log
        self._topics = {number: topic for topic, number in channels.items()}
        self._wanted: dict[str, int] = {}  # subscription by topic
        self._waiting: dict[str, list[tuple[int, bytes]]] = {}
        self._some = asyncio.Event()
        self._bucket = Bucket(WISHES, WISHES_BURST)

    async def serve(self, newest: Newest) -> None:
        """Until it goes. `newest`: what a new subscription is sent at once, changed meanwhile."""
        sender = asyncio.create_task(self._send())
        try:
            with suppress(ConnectionClosed):
                async for raw in self._socket:
                    if not self._bucket.take(self._clock.now()):
                        await self._socket.close(CloseCode.POLICY_VIOLATION, "too many messages")
                        return
                    await self._heed(raw, newest)
        finally:
            sender.cancel()

    def put(self, topic: str, at_ns: int, data: bytes) -> None:
        """A new message; it waits if the topic is wanted."""
        if topic not in self._wanted:
            return
        waiting = self._waiting.setdefault(topic, [])
        if topic != LOG_TOPIC or len(waiting) == LOG_ROOM:
            del waiting[:1]
        waiting.append((at_ns, data))
        self._some.set()

    async def _heed(self, raw: str | bytes, newest: Newest) -> None:
        if isinstance(raw, bytes):
            return await self._refuse("data")
        try:
            wish = read_wish(raw)
        except msgspec.DecodeError as e:
            return await self._socket.close(CloseCode.UNSUPPORTED_DATA, str(e)[:100])
        match wish:
            case Subscribe():
                for w in wish.subscriptions:
                    topic = self._topics.get(w.channel_id)
                    if topic is None or topic in self._wanted or w.id in self._wanted.values():
                        continue  # one that there is not, or a second one of a channel
                    self._wanted[topic] = w.id
                    if topic in newest:
                        self.put(topic, *newest[topic])
            case Unsubscribe():
                gone = set(wish.subscription_ids)
                self._wanted = {t: i for t, i in self._wanted.items() if i not in gone}
            case str(op):
                await self._refuse(op)

    async def _refuse(self, what: str) -> None:
        self._log.tell("viewer", f"a viewer asked for {what[:40]!r}: it may only look")
        await self._socket.send(refusal("Flinch only shows: nothing can be sent to it from here"))

    async def _send(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                await self._some.wait()
                self._some.clear()
                while self._waiting:
                    topic = next(iter(self._waiting))
                    for at_ns, data in self._waiting.pop(topic):
                        if topic in self._wanted:
                            frame = message_data(self._wanted[topic], at_ns, data)
                            await self._socket.send(frame)
