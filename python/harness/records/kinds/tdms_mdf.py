# SPDX-License-Identifier: MIT
"""Reads TDMS files of LabVIEW, and MF4 and MDF files of measurement systems in vehicles."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from contextlib import suppress
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..log import Kind, Log, Read, Series, as_float

VALUE_BYTES = 8
UNSET = np.datetime64("1904-01-02")
SCALE_TYPE = re.compile(r"NI_Scale\[\d+\]_Scale_Type")
# Those that the reader applies; it passes over all others.
SCALES = ("Linear", "Polynomial", "Table", "RTD", "Strain", "Thermistor", "Thermocouple", "Add",
          "Subtract", "AdvancedAPI")  # fmt: skip


def read_tdms(data: bytes, path: Path) -> Log:
    """Returns the channels of a file as a log; waveforms bring their sampling time."""
    import nptdms

    with damage_named(path, "TDMS"):
        file = nptdms.TdmsFile.open(BytesIO(data))
        channels = [channel for group in file.groups() for channel in group.channels()]
        COLUMNS.check(len(channels), path)
        # The lengths stand in the heads of the segments; no value is read for them.
        BYTES.check(sum(len(channel) for channel in channels) * VALUE_BYTES, path)
        names = [channel.name for channel in channels]
        notes: list[str] = []
        starts = _starts(channels, notes)
        series = [
            _series(
                channel, names.count(channel.name) > 1, starts.get(channel.path, 0.0), file, path
            )
            for channel in channels
            if len(channel)
        ]
    texts = tuple(str(channel.name) for channel in channels if not _has_numbers(channel))
    made = tuple(one for one in series if one is not None)
    return Log("TDMS", made, notes=tuple(notes), texts=texts)


def _starts(channels: Sequence[Any], notes: list[str]) -> dict[str, float]:
    """Returns by path how much later than the first waveform each one starts, in seconds.

    A start in 1904 or before is that of a waveform whose start was not set.
    """
    starts = {
        channel.path: start.astype("datetime64[ns]")
        for channel in channels
        if len(channel)
        and _step(channel) is not None
        and isinstance(start := channel.properties.get("wf_start_time"), np.datetime64)
        and start > UNSET
    }
    if not starts:
        return {}
    first = min(starts.values())
    later = {path: float((start - first) / np.timedelta64(1, "s")) for path, start in
             starts.items()}  # fmt: skip
    if any(later.values()):
        notes.append(
            f"the waveforms start at different times, up to {max(later.values()):.6g} s apart: "
            "their wf_start_time is used"
        )
        without = [c.name for c in channels if _step(c) is not None and c.path not in starts]
        if without:
            notes.append(f"taken to start with the first: {', '.join(without)} (no wf_start_time)")
    return later


def _step(channel: Any) -> float | None:
    """Returns the sampling time of a waveform in seconds; None for another channel."""
    step = channel.properties.get("wf_increment")
    return float(step) if isinstance(step, int | float) and 0.0 < step < np.inf else None


def _check_scales(channel: Any, file: Any, name: str, path: Path) -> None:
    """Refuses a channel with a scale that the reader leaves out."""
    levels = (channel.properties, file[channel.group_name].properties, file.properties)
    for properties in levels:
        if properties.get("NI_Scaling_Status") == "scaled":
            continue
        for key, kind in properties.items():
            if SCALE_TYPE.fullmatch(key) and kind not in SCALES:
                raise RecordError(
                    path,
                    f"the file holds raw numbers, and their scale, of type '{kind}', is not known",
                    column=name,
                    expected=f"a scale of a known type: {', '.join(SCALES)}",
                    mend="export the scaled values, or leave the column out with --map",
                )


def _has_numbers(channel: Any) -> bool:
    return channel.dtype.kind in "fiubmM"


def _series(channel: Any, repeated: bool, later_s: float, file: Any, path: Path) -> Series | None:
    """Returns a channel, under the name of its group too where another one has its name."""
    name = f"{channel.group_name}/{channel.name}" if repeated else str(channel.name)
    SAMPLES.check(len(channel), path)
    is_time = channel.dtype.kind in "mM"
    if not _has_numbers(channel):
        return None

    @cache
    def values() -> FloatArray:
        _check_scales(channel, file, name, path)
        with damage_named(path, "TDMS"):
            found = channel[:]
        return as_float(found, name, path)

    step = _step(channel)
    time: Read | None = None
    if step is not None:
        start = channel.properties.get("wf_start_offset", 0.0)
        offset = float(start) if isinstance(start, int | float) and np.isfinite(start) else 0.0
        start_s, count = later_s + offset, len(channel)
        time = cache(lambda: start_s + step * np.arange(count, dtype=np.float64))
    unit = channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription")
    return Series(
        name,
        len(channel),
        values,
        "s" if is_time else (str(unit) if unit else None),
        group=f"{channel.group_name}|{len(channel)}",
        time=time,
        is_time=is_time,
    )


TDMS = Kind(read_tdms, ("tdms",), rb"TDSm", unbounded=True)


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


def read_mdf(data: bytes, path: Path) -> Log:
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
        raw = [n for n, g in groups if any(RAW_FRAME.match(str(one.name)) for one in g.channels)]
        if raw and not any(
            int(group.channel_group.cycles_nr) > 0 and len(group.channels) > 1
            for number, group in groups
            if number not in raw
        ):
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
            str(getattr(channel, "unit", "") or "")
            or str(file.get_channel_unit(group=number, index=index) or "").strip()
            or None,
            group=str(number),
            time=time if master is not None else None,
        )
        for index, channel in enumerate(group.channels)
        if index != master
    ]


def _check_compressed(data: bytes, path: Path) -> None:
    """Checks the lengths that compressed blocks state, before anything is decompressed."""
    total, at = 0, data.find(COMPRESSED)
    while at >= 0:
        if at + LENGTH_AT + 8 <= len(data):
            total += struct.unpack_from("<Q", data, at + LENGTH_AT)[0]
        BYTES.check(total, path)
        at = data.find(COMPRESSED, at + 1)


MDF = Kind(read_mdf, ("mf4", "mdf", "mf3", "mdf3"), rb"MDF     |UnFinMF ", unbounded=True)
