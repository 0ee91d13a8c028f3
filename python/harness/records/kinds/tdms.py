# SPDX-License-Identifier: MIT
"""Reads logs from TDMS files, the format of LabVIEW."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..logs.log import Kind, Log, Read, Series, as_float

VALUE_BYTES = 8
UNSET = np.datetime64("1904-01-02")
SCALE_TYPE = re.compile(r"NI_Scale\[\d+\]_Scale_Type")
# Those that the reader applies; it passes over all others.
SCALES = ("Linear", "Polynomial", "Table", "RTD", "Strain", "Thermistor", "Thermocouple", "Add",
          "Subtract", "AdvancedAPI")  # fmt: skip


def read(data: bytes, path: Path) -> Log:
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


KIND = Kind(read, ("tdms",), rb"TDSm", unbounded=True)
