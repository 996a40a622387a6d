"""The views in an MCAP file: schemas and channels as topics come."""

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import Writer

from app.messages import Snapshot
from app.record.views.schemas import schema_bytes, schema_name
from app.record.views.values import View
from app.record.views.views import Views


class ViewWriter:
    """Writes a run's views through a started `Writer`, beside whatever else is in the file."""

    def __init__(self, writer: Writer, views: Views) -> None:
        self._writer, self._views = writer, views
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._count: dict[str, int] = {}

    def write(self, snapshot: Snapshot, at_ns: int, full: bool = True) -> None:
        """A picture of a tick at `at_ns` [ns] since 1970; not `full`: only what people are told."""
        views = self._views.of if full else self._views.log
        for topic, message in views(snapshot, at_ns):
            self._add((topic, message), at_ns)

    def _add(self, view: View, at_ns: int) -> None:
        topic, message = view
        sequence = self._count.get(topic, 0)
        self._count[topic] = sequence + 1
        self._writer.add_message(
            self._channels[topic] if topic in self._channels else self._open(topic, type(message)),
            log_time=at_ns, publish_time=at_ns, sequence=sequence,
            data=message.SerializeToString(),
        )  # fmt: skip

    def _open(self, topic: str, kind: type) -> int:
        name = schema_name(kind)
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(
                name, SchemaEncoding.Protobuf, schema_bytes(kind)
            )
        self._channels[topic] = self._writer.register_channel(
            topic=topic, message_encoding=MessageEncoding.Protobuf, schema_id=self._schemas[name]
        )
        return self._channels[topic]
