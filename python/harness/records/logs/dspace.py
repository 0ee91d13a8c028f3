# SPDX-License-Identifier: MIT
"""Reads recordings of dSPACE ControlDesk in MAT files: one structure with the fields X and Y.

X has the axes of time and Y the signals, each with Name and Data; Y has the number of its axis in
XIndex, and its unit in Unit, where the version of ControlDesk writes them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import FloatArray
from ...catalogue.channels import TIME
from ..errors import RecordError
from ..limits import COLUMNS, SAMPLES
from .arrays import as_float
from .clock import SECONDS
from .log import Series
from .units import pint_unit

KIND = "MAT file of dSPACE ControlDesk"


def is_recording(value: Any) -> bool:
    """Whether a variable is a recording of ControlDesk."""
    fields = getattr(getattr(value, "dtype", None), "names", None) or ()
    if not {"X", "Y"} <= set(fields) or value.size != 1:
        return False
    inner = (value.reshape(-1)[0][name] for name in ("X", "Y"))
    return all({"Name", "Data"} <= set(one.dtype.names or ()) and one.size for one in inner)


def series_of_recording(
    value: Any, path: Path, notes: list[str], *, within: str = ""
) -> list[Series]:
    """Returns the signals of a recording, each with its time; `within` precedes their names.

    Raises
    ------
    RecordError
        a signal has no axis of its length, or the unit of its time is none.
    """
    axes, signals = (list(value.reshape(-1)[0][name].reshape(-1)) for name in ("X", "Y"))
    COLUMNS.check(len(signals), path)
    times = [np.asarray(one["Data"]).reshape(-1) for one in axes]
    names = [_name(one) or f"Y({k})" for k, one in enumerate(signals, start=1)]
    repeated = {name for name, count in Counter(names).items() if count > 1}
    first = min((int(index) for one in signals if (index := _number(one, "XIndex")) is not None),
                default=1)  # fmt: skip
    made = []
    for name, one in zip(names, signals, strict=True):
        data = np.asarray(one["Data"]).reshape(-1)
        label = within + (f"{_text(one, 'Path')}/{name}" if name in repeated else name)
        if data.size < 2 or data.dtype.kind not in "fiub":
            notes.append(f"'{label}' is left out: it holds no series of numbers")
            continue
        SAMPLES.check(data.size, path)
        axis = _axis(one, data.size, times, min(first, 1), label, path)
        time = times[axis] * _seconds(_text(axes[axis], "Unit"), label, path)
        unit, group = _text(one, "Unit") or None, f"{within}X({axis + 1})"
        made.append(_series(label, data, time, unit, group, path))
    return made


def _series(
    name: str, data: Any, time: FloatArray, unit: str | None, group: str, path: Path
) -> Series:
    return Series(
        name,
        data.size,
        lambda: as_float(data, name, path),
        unit,
        group,
        time=lambda: as_float(time, name, path),
    )


def _axis(signal: Any, size: int, times: Sequence[Any], first: int, name: str, path: Path) -> int:
    """Returns the number of the axis of a signal, from 0: the one of XIndex, or of its length."""
    fitting = [k for k, one in enumerate(times) if one.size == size]
    stated = _number(signal, "XIndex")
    if stated is not None and int(stated) - first in fitting:
        return int(stated) - first
    if len(fitting) == 1:
        return fitting[0]
    raise RecordError(
        path,
        f"{len(fitting) or 'none'} of the {len(times)} axes X of this recording of dSPACE "
        f"ControlDesk fit the {size} values",
        column=name,
        expected="one axis of time for each signal in Y",
        mend="record the signals with one raster, or export them as CSV",
    )


def _seconds(unit: str, name: str, path: Path) -> float:
    known = pint_unit(unit, TIME) if unit else "s"
    if known not in SECONDS:
        raise RecordError(
            path,
            f"its axis X has the unit '{unit}', which is none of time",
            column=name,
            expected=f"one of {', '.join(SECONDS)}",
            mend="record it over time",
        )
    return SECONDS[known]


def _name(signal: Any) -> str:
    """Returns the name of a signal; that of a port, "Model/Valve/Out1", is the one of its block."""
    return re.sub(r"(?<=.)/(?:Out|In)\d+$", "", _text(signal, "Name").replace('"', ""))


def _text(element: Any, field: str) -> str:
    """Returns a field that holds text; empty where there is none."""
    value = element[field] if field in (element.dtype.names or ()) else np.array("")
    return str(value.reshape(-1)[0]).strip() if value.size == 1 and value.dtype.kind == "U" else ""


def _number(element: Any, field: str) -> float | None:
    """Returns a field that holds one number; None where there is none."""
    value = element[field] if field in (element.dtype.names or ()) else np.array([])
    return float(value.reshape(-1)[0]) if value.size == 1 and value.dtype.kind in "fiu" else None
