# SPDX-License-Identifier: MIT
"""Reads logs from TDMS files, the format of LabVIEW."""

from __future__ import annotations

from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import nptdms
import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.records.errors import RecordError, damaged
from ehsid.harness.records.limits import BYTES, COLUMNS, SAMPLES
from ehsid.harness.records.logs.arrays import as_float
from ehsid.harness.records.logs.log import Log, Read, Series

VALUE_BYTES = 8


def read(data: bytes, path: Path) -> Log:
    """Returns the channels of a file as a log; waveforms bring their sampling time.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    try:
        file = nptdms.TdmsFile.open(BytesIO(data))
        channels = [channel for group in file.groups() for channel in group.channels()]
        COLUMNS.check(len(channels), path)
        # The lengths stand in the heads of the segments; no value is read for them.
        BYTES.check(sum(len(channel) for channel in channels) * VALUE_BYTES, path)
        names = [channel.name for channel in channels]
        series = [
            _series(channel, names.count(channel.name) > 1, path)
            for channel in channels
            if len(channel)
        ]
    except RecordError:
        raise
    except Exception as error:  # the reader has no common exception for damaged files
        raise damaged(path, "TDMS", error) from None
    texts = tuple(str(channel.name) for channel in channels if not _has_numbers(channel))
    return Log("TDMS", tuple(one for one in series if one is not None), texts=texts)


def _has_numbers(channel: Any) -> bool:
    return channel.dtype.kind in "fiubmM"


def _series(channel: Any, repeated: bool, path: Path) -> Series | None:
    """Returns a channel, under the name of its group too where another one has its name."""
    name = f"{channel.group_name}/{channel.name}" if repeated else str(channel.name)
    SAMPLES.check(len(channel), path)
    is_time = channel.dtype.kind in "mM"
    if not _has_numbers(channel):
        return None

    @cache
    def values() -> FloatArray:
        try:
            found = channel[:]
        except Exception as error:  # as in `read`
            raise damaged(path, "TDMS", error) from None
        return as_float(found, name, path)

    step = channel.properties.get("wf_increment")
    time: Read | None = None
    if isinstance(step, int | float) and 0.0 < step < np.inf:
        start = channel.properties.get("wf_start_offset", 0.0)
        offset = float(start) if isinstance(start, int | float) and np.isfinite(start) else 0.0
        time = cache(partial(_even, offset, float(step), len(channel)))
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


def _even(start: float, step: float, count: int) -> FloatArray:
    return start + step * np.arange(count, dtype=np.float64)
