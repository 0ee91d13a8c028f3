# SPDX-License-Identifier: MIT
"""Reads MCAP files with messages of ROS 1, ROS 2 or JSON, and bags of ROS.

A bag is a .bag file of ROS 1, or the folder of a bag of ROS 2. Messages are taken apart into
series, one for each number of a message.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from io import BytesIO
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..log import Kind, Log, Series

MAX_DEPTH = 6
# Longer arrays are images and point clouds.
MOST_ELEMENTS = 32
# Fields of the head of a message, which are no signals.
HEAD = ("header", "stamp", "seq")
NANOSECOND = 1e-9
NEAR_NS = 60_000_000_000

Decode = Callable[[bytes], Any]
Messages = Callable[[], Iterable[tuple[int, Any]]]


def read_mcap(data: bytes, path: Path) -> Log:
    """Returns the numbers in the messages of a file as a log, topic by topic."""
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    notes: list[str] = []
    with damage_named(path, "MCAP"):
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
            messages = partial(_messages_of_channel, data, channel.topic, channel.id, decode)
            first = next(iter(messages()), None)
            counts = summary.statistics.channel_message_counts if summary.statistics else {}
            count = counts.get(channel.id, 0)
            if first is not None:
                series += topic_series(
                    channel.topic, first[1], messages, count, start, path, "MCAP"
                )
    return Log("MCAP", tuple(series), 1, tuple(notes))


def _messages_of_channel(
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


def topic_series(
    topic: str,
    first: Any,
    messages: Messages,
    count: int,
    start_ns: int,
    path: Path,
    kind: str,
) -> list[Series]:
    """Returns a series for each number in the messages of a topic.

    `first` is one message, which tells the fields. `messages` returns time in nanoseconds and
    content of each message; `count` is their number, as the file states it. `start_ns` is the time
    that counts as 0 s. `path` and `kind` are for messages of errors.
    """

    @cache
    def table() -> tuple[FloatArray, dict[str, FloatArray]]:
        times: list[int] = []
        rows: list[dict[str, float]] = []
        with damage_named(path, kind):
            for log_ns, message in messages():
                stamp = stamp_of(message)
                # A stamp far from the time of writing is on another clock than other topics.
                near = stamp is not None and abs(stamp - log_ns) < NEAR_NS
                times.append(stamp if stamp is not None and near else log_ns)
                rows.append(dict(numbers_of(message)))
                SAMPLES.check(len(rows), path)
        ticks = np.array(times, dtype=np.int64) - start_ns
        seconds = np.asarray(ticks * NANOSECOND, dtype=np.float64)
        names = list(rows[0]) if rows else []
        nan = float("nan")
        return seconds, {name: np.array([row.get(name, nan) for row in rows]) for name in names}

    def values(field: str) -> FloatArray:
        return table()[1][field]

    fields = [name for name, _ in numbers_of(first)]
    COLUMNS.check(len(fields), path)
    whole = fields == ["data"]  # a message of one number is the topic itself
    return [
        Series(
            topic if whole else f"{topic}/{field}",
            count,
            partial(values, field),
            group=topic,
            time=lambda: table()[0],
        )
        for field in fields
    ]


def numbers_of(message: Any, path: str = "", depth: int = 0) -> Iterator[tuple[str, float]]:
    """Yields each number in a message with its path, such as "pose.position.x"."""
    if isinstance(message, bool | Real | np.number):
        yield path, float(message)
        return
    if depth > MAX_DEPTH or isinstance(message, str | bytes):
        return
    if isinstance(message, Mapping):
        items = [(str(key), value) for key, value in message.items()]
    elif isinstance(message, list | tuple | np.ndarray):
        if len(message) > MOST_ELEMENTS:
            return
        items = [(f"[{k}]", value) for k, value in enumerate(message)]
    elif dataclasses.is_dataclass(message):
        items = [(one.name, getattr(message, one.name)) for one in dataclasses.fields(message)]
    else:
        return
    for name, value in items:
        if not (depth == 0 and name in HEAD) and not name.startswith("__"):
            below = name if not path else path + name if name[0] == "[" else f"{path}.{name}"
            yield from numbers_of(value, below, depth + 1)


def stamp_of(message: Any) -> int | None:
    """Returns the time in the head of a message in nanoseconds, if it has one that was set."""
    head = _field(message, "header")
    stamp = _field(head if head is not None else message, "stamp")
    seconds = next((s for key in ("sec", "secs") if (s := _field(stamp, key)) is not None), None)
    parts = (_field(stamp, key) for key in ("nanosec", "nsec", "nsecs"))
    rest = next((part for part in parts if part is not None), 0)
    if not isinstance(seconds, int | np.integer) or not isinstance(rest, int | np.integer):
        return None
    return int(seconds) * 1_000_000_000 + int(rest) or None


def _field(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, Mapping) else getattr(value, name, None)


MCAP = Kind(read_mcap, ("mcap",), rb"\x89MCAP0\r\n", unbounded=True)


def read_rosbag(data: bytes, path: Path) -> Log:
    """Returns the numbers in the messages of a bag as a log, topic by topic.

    The reader takes a path, so `data` is not used.
    """
    bag = path.parent if path.suffix.lower() == ".db3" else path
    if path.suffix.lower() == ".db3" and not (bag / "metadata.yaml").is_file():
        raise RecordError(
            path,
            "metadata.yaml is not beside it",
            expected="the whole folder of a ROS 2 bag",
            mend="copy the folder, or make the file anew with 'ros2 bag reindex'",
        )
    series: list[Series] = []
    notes: list[str] = []
    with damage_named(path, "ROS bag"):
        with _opened_bag(bag) as reader:
            COLUMNS.check(len(reader.connections), path)
            start = int(reader.start_time)
            firsts = []
            for connection in reader.connections:
                try:
                    first = next(iter(_messages_of(reader, connection)), None)
                except KeyError:
                    notes.append(f"'{connection.topic}' is left out: its type is not known")
                    continue
                firsts.append((connection, first))
        for connection, first in firsts:
            if first is not None:
                messages = partial(_messages, bag, connection.topic)
                series += topic_series(
                    connection.topic,
                    first[1],
                    messages,
                    connection.msgcount,
                    start,
                    path,
                    "ROS bag",
                )
    return Log("ROS bag", tuple(series), 1, tuple(notes))


def _opened_bag(bag: Path) -> Any:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    return AnyReader([bag], default_typestore=get_typestore(Stores.LATEST))


def _messages(bag: Path, topic: str) -> Iterator[tuple[int, Any]]:
    with _opened_bag(bag) as reader:
        for connection in reader.connections:
            if connection.topic == topic:
                yield from _messages_of(reader, connection)


def _messages_of(reader: Any, connection: Any) -> Iterator[tuple[int, Any]]:
    for _, time_ns, raw in reader.messages(connections=[connection]):
        yield time_ns, reader.deserialize(raw, connection.msgtype)


ROSBAG = Kind(read_rosbag, ("bag", "db3"), rb"#ROSBAG V2\.0", unbounded=True)
