"""The viewers' protocol, as far as it is about looking (github.com/foxglove/ws-protocol).

JSON goes both ways but for the data, which is binary:

    1 (u8) | subscription (u32) | time [ns] (u64) | message          little-endian
"""

from base64 import b64encode
from collections.abc import Mapping
from struct import Struct
from typing import Annotated, Any

import msgspec
from websockets.typing import Subprotocol

from app.record.views.schemas import schema_bytes, schema_name

# two names of what we speak of it
SUBPROTOCOLS = (Subprotocol("foxglove.sdk.v1"), Subprotocol("foxglove.websocket.v1"))
MESSAGE_DATA = Struct("<BIQ")
ERROR = 2  # level of a status
Number = Annotated[int, msgspec.Meta(ge=0, lt=1 << 32)]


class Wish(msgspec.Struct, rename="camel"):
    """One channel that a viewer wants, and by which number it will know it."""

    id: Number
    channel_id: Number


class Subscribe(msgspec.Struct, tag_field="op", tag="subscribe"):
    """From now on send these."""

    subscriptions: list[Wish]


class Unsubscribe(msgspec.Struct, tag_field="op", tag="unsubscribe", rename="camel"):
    """Send these no longer."""

    subscription_ids: list[Number]


class _Anything(msgspec.Struct):
    op: str


_wishes = msgspec.json.Decoder(Subscribe | Unsubscribe)
_anything = msgspec.json.Decoder(_Anything)


def read_wish(text: str) -> Subscribe | Unsubscribe | str:
    """What a viewer asks for; the name of what it asks for in vain.

    Raises `msgspec.DecodeError` for what is no message of this protocol.
    """
    op = _anything.decode(text).op
    return _wishes.decode(text) if op in ("subscribe", "unsubscribe") else op


def server_info(name: str, session: str) -> str:
    """The first message to a viewer. No capabilities: it may look, and nothing else."""
    return _text(op="serverInfo", name=name, capabilities=[], sessionId=session)


def advertise(channels: Mapping[str, int], schemas: Mapping[str, type]) -> str:
    """The topics that there are: their numbers, and their messages' schemas, by topic."""
    rows = [
        {
            "id": number, "topic": topic, "encoding": "protobuf", "schemaEncoding": "protobuf",
            "schemaName": schema_name(schemas[topic]),
            "schema": b64encode(schema_bytes(schemas[topic])).decode("ascii"),
        }
        for topic, number in channels.items()
    ]  # fmt: skip
    return _text(op="advertise", channels=rows)


def refusal(words: str) -> str:
    """A status that a viewer shows to its person."""
    return _text(op="status", level=ERROR, message=words)


def message_data(subscription: int, at_ns: int, data: bytes) -> bytes:
    """A message of a subscribed channel."""
    return MESSAGE_DATA.pack(1, subscription, at_ns) + data


def _text(**fields: Any) -> str:
    return msgspec.json.encode(fields).decode()
