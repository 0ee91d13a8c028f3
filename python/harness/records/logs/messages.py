# SPDX-License-Identifier: MIT
"""Messages of a robot's log, taken apart into series: one for each number of a message."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import FloatArray
from ..errors import RecordError, damaged
from ..limits import COLUMNS, SAMPLES
from .log import Series

MAX_DEPTH = 6
# Longer arrays are images and point clouds.
MOST_ELEMENTS = 32
# Fields of the head of a message, which are no signals.
HEAD = ("header", "stamp", "seq")
NANOSECOND = 1e-9
NEAR_NS = 60_000_000_000

Messages = Callable[[], Iterable[tuple[int, Any]]]


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

    Parameters
    ----------
    topic
        name of the topic, which is the first part of the names of the series.
    first
        one message, which tells the fields.
    messages
        returns time in nanoseconds and content of each message of the topic.
    count
        number of messages, as the file states it.
    start_ns
        time in nanoseconds that counts as 0 s.
    path
        the file, for messages of errors.
    kind
        what the file is, for the same.
    """

    @cache
    def table() -> tuple[FloatArray, dict[str, FloatArray]]:
        times: list[int] = []
        rows: list[dict[str, float]] = []
        try:
            for log_ns, message in messages():
                stamp = stamp_of(message)
                # A stamp far from the time of writing is on another clock than other topics.
                near = stamp is not None and abs(stamp - log_ns) < NEAR_NS
                times.append(stamp if stamp is not None and near else log_ns)
                rows.append(dict(numbers_of(message)))
                SAMPLES.check(len(rows), path)
        except RecordError:
            raise
        except Exception as error:  # the readers have several families of exceptions
            raise damaged(path, kind, error) from None
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
