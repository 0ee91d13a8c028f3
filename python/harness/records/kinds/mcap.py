# SPDX-License-Identifier: MIT
"""Reads logs from MCAP files with messages of ROS 1, ROS 2 or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

from ..errors import RecordError, damaged
from ..limits import BYTES, COLUMNS
from ..logs.log import Kind, Log, Series
from ..logs.messages import topic_series

Decode = Callable[[bytes], Any]


def read(data: bytes, path: Path) -> Log:
    """Returns the numbers in the messages of a file as a log, topic by topic.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    notes: list[str] = []
    try:
        summary = make_reader(BytesIO(data)).get_summary()
        if summary is None:
            raise McapError("it has no summary; mend it with 'mcap recover'")
        # A chunk may hold more than it states; `bounded_memory` is for these.
        BYTES.check(sum(chunk.uncompressed_size for chunk in summary.chunk_indexes), path)
        COLUMNS.check(len(summary.channels), path)
        start = 0 if summary.statistics is None else summary.statistics.message_start_time
        series: list[Series] = []
        for channel in summary.channels.values():
            decode = _decoder(channel.message_encoding, summary.schemas.get(channel.schema_id))
            if decode is None:
                notes.append(
                    f"'{channel.topic}' is left out: messages in '{channel.message_encoding}' are "
                    "not read"
                )
                continue
            messages = partial(_messages, data, channel.topic, channel.id, decode)
            first = next(iter(messages()), None)
            counts = summary.statistics.channel_message_counts if summary.statistics else {}
            count = counts.get(channel.id, 0)
            if first is not None:
                series += topic_series(
                    channel.topic, first[1], messages, count, start, path, "MCAP"
                )
    except RecordError:
        raise
    except Exception as error:  # of the reader, the compression and the decoders
        raise damaged(path, "MCAP", error) from None
    return Log("MCAP", tuple(series), 1, tuple(notes))


def _messages(
    data: bytes, topic: str, channel_id: int, decode: Decode
) -> Iterator[tuple[int, Any]]:
    from mcap.reader import make_reader

    for _, channel, message in make_reader(BytesIO(data)).iter_messages(topics=[topic]):
        if channel.id == channel_id:
            yield message.log_time, decode(message.data)


def _decoder(encoding: str, schema: Any) -> Decode | None:
    """Returns the function that decodes the messages of a channel, or None if there is none."""
    if encoding == "json":
        return json.loads
    if schema is None or (encoding, schema.encoding) not in (
        ("cdr", "ros2msg"),
        ("cdr", "ros2idl"),
        ("ros1", "ros1msg"),
    ):
        return None
    return _ros(schema.name, schema.data.decode(), schema.encoding)


@cache
def _ros(name: str, text: str, encoding: str) -> Decode:
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1msg" else Stores.LATEST)
    parse = get_types_from_idl if encoding == "ros2idl" else None
    full = name if name.count("/") > 1 else name.replace("/", "/msg/")
    types = parse(text) if parse else get_types_from_msg(text, full)
    known = {key: value for key, value in types.items() if key not in store.types}
    store.register(known)
    if encoding == "ros1msg":
        return partial(store.deserialize_ros1, typename=full)
    return partial(store.deserialize_cdr, typename=full)


KIND = Kind(read, ("mcap",), rb"\x89MCAP0\r\n", unbounded=True)
