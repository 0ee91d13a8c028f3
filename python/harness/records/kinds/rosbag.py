# SPDX-License-Identifier: MIT
"""Reads logs from ROS bags: a .bag file of ROS 1, or the folder of a bag of ROS 2."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import COLUMNS, RecordError, damage_named
from ..logs.log import Kind, Log, Series
from .mcap import topic_series


def read(data: bytes, path: Path) -> Log:
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
        with _opened(bag) as reader:
            COLUMNS.check(len(reader.connections), path)
            start = int(reader.start_time)
            firsts = []
            for connection in reader.connections:
                try:
                    first = next(iter(_of(reader, connection)), None)
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


def _opened(bag: Path) -> Any:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    return AnyReader([bag], default_typestore=get_typestore(Stores.LATEST))


def _messages(bag: Path, topic: str) -> Iterator[tuple[int, Any]]:
    with _opened(bag) as reader:
        for connection in reader.connections:
            if connection.topic == topic:
                yield from _of(reader, connection)


def _of(reader: Any, connection: Any) -> Iterator[tuple[int, Any]]:
    for _, time_ns, raw in reader.messages(connections=[connection]):
        yield time_ns, reader.deserialize(raw, connection.msgtype)


KIND = Kind(read, ("bag", "db3"), rb"#ROSBAG V2\.0", unbounded=True)
