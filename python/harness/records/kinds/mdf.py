# SPDX-License-Identifier: MIT
"""Reads logs from MF4 and MDF files, the format of measurement systems in vehicles."""

from __future__ import annotations

import re
import struct
from contextlib import suppress
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..logs.log import Kind, Log, Series, as_float

# A block of compressed data; its original length stands behind its head of 24 bytes and 8 more.
COMPRESSED = b"##DZ"
LENGTH_AT = 32
# Numbers of the types of text in versions 4 and 3 of the format.
TEXT_TYPES, TEXT_TYPES_3 = (6, 7, 8, 9), (7,)
# Names that ASAM gives to the channels of raw frames.
RAW_FRAME = re.compile(r"(CAN|LIN|FLX|ETH|MOST|USB|K_LINE)_(\w*Frame|Message)(\.|$)")
DECODE = (
    "decode the frames to signals first, with the database of the bus (DBC, ARXML), such as by "
    "asammdf's MDF.extract_bus_logging"
)


def _close_quietly(file: Any) -> None:
    with suppress(Exception):
        file.close()


def read(data: bytes, path: Path) -> Log:
    """Returns the channels of a file as a log; each group has its own master channel as time."""
    import asammdf

    # Their own __del__ raises where the file was refused half read: Python prints a traceback then.
    for kind in (asammdf.blocks.mdf_v3.MDF3, asammdf.blocks.mdf_v4.MDF4):
        kind.__del__ = _close_quietly
    _check_compressed(data, path)
    with damage_named(path, "MF4"):
        file = asammdf.MDF(BytesIO(data), raise_on_multiple_occurrences=False)
        groups = list(enumerate(file.groups))
        BYTES.check(
            sum(int(g.channel_group.cycles_nr) * int(g.channel_group.samples_byte_nr)
                for _, g in groups),
            path,
        )  # fmt: skip
        COLUMNS.check(sum(len(g.channels) for _, g in groups), path)
        raw = [number for number, group in groups if _has_raw_frames(group)]
        if raw and not any(_has_signals(g) for number, g in groups if number not in raw):
            raise RecordError(
                path,
                "the file holds raw frames of a bus, such as CAN, and no signals",
                expected="signals with numbers",
                mend=DECODE,
            )
        groups = [(number, group) for number, group in groups if number not in raw]
        series = [one for number, group in groups for one in _of_group(file, number, group, path)]
    version = str(file.version)
    texts = [
        str(channel.name)
        for _, group in groups
        for channel in group.channels
        if channel.data_type in (TEXT_TYPES if version >= "4" else TEXT_TYPES_3)
    ]
    notes = (f"{len(raw)} groups of raw bus frames are left out: {DECODE}",) if raw else ()
    return Log(f"MDF {version}", tuple(series), notes=notes, texts=tuple(texts))


def _has_raw_frames(group: Any) -> bool:
    return any(RAW_FRAME.match(str(channel.name)) for channel in group.channels)


def _has_signals(group: Any) -> bool:
    return int(group.channel_group.cycles_nr) > 0 and len(group.channels) > 1


def _of_group(file: Any, number: int, group: Any, path: Path) -> list[Series]:
    count = int(group.channel_group.cycles_nr)
    SAMPLES.check(count, path)
    master = file.masters_db.get(number)
    if count < 1:
        return []

    @cache
    def time() -> FloatArray:
        with damage_named(path, "MF4"):
            return np.asarray(file.get_master(number), dtype=np.float64)

    @cache
    def values(index: int) -> FloatArray:
        with damage_named(path, "MF4"):
            # All samples, so that each has its time; with False the invalid ones are left out.
            signal = file.get(group=number, index=index, ignore_invalidation_bits=True)
        if signal.samples.ndim != 1 or signal.samples.dtype.names:
            raise RecordError(
                path,
                "it has several numbers in each sample",
                column=signal.name,
                expected="one number in each sample",
                mend="export each of them as a channel, or name other columns to use",
            )
        numbers = as_float(signal.samples, signal.name, path)
        invalid = signal.invalidation_bits
        if invalid is not None:
            numbers = np.where(np.asarray(invalid, dtype=bool), np.nan, numbers)
        return numbers

    return [
        Series(
            str(channel.name),
            count,
            partial(values, index),
            str(getattr(channel, "unit", "") or "") or _unit(file, number, index),
            group=str(number),
            time=time if master is not None else None,
        )
        for index, channel in enumerate(group.channels)
        if index != master
    ]


def _unit(file: Any, group: int, index: int) -> str | None:
    return str(file.get_channel_unit(group=group, index=index) or "").strip() or None


def _check_compressed(data: bytes, path: Path) -> None:
    """Checks the lengths that compressed blocks state, before anything is decompressed."""
    total, at = 0, data.find(COMPRESSED)
    while at >= 0:
        if at + LENGTH_AT + 8 <= len(data):
            total += struct.unpack_from("<Q", data, at + LENGTH_AT)[0]
        BYTES.check(total, path)
        at = data.find(COMPRESSED, at + 1)


KIND = Kind(read, ("mf4", "mdf", "mf3", "mdf3"), rb"MDF     |UnFinMF ", unbounded=True)
