# SPDX-License-Identifier: MIT
"""Reads logs from MAT files of version 4 to 7: variables, structures, Simulink logs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..mat_format import MatTable
from . import dspace
from .arrays import Part, series_of
from .log import Log
from .matlab_objects import object_parts

MAX_DEPTH = 8
MOST_ELEMENTS = 64
# How objects of MATLAB, such as timetables, come out of the reader.
OPAQUE = "MatlabOpaque"


def read(data: bytes, path: Path) -> Log:
    """Returns the variables and the fields of structures as a log, with paths as names.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    table = MatTable(data, path)
    notes: list[str] = []
    recorded = {name: one for name, one in table.variables.items() if dspace.is_recording(one)}
    if recorded and recorded.keys() == table.variables.keys():
        series = [
            one
            for name, value in recorded.items()
            for one in dspace.series_of_recording(
                value, path, notes, within=f"{name}." if len(recorded) > 1 else ""
            )
        ]
        return Log(dspace.KIND, tuple(series), 1, tuple(notes))
    parts = [part for name, value in table.variables.items() for part in _parts((name,), value, 0)]
    if any(type(value).__name__ == OPAQUE for value in table.variables.values()):
        parts += object_parts(data, notes)
    return Log("MAT file", series_of(parts, path), 1, tuple(notes))


def _parts(path: tuple[str, ...], value: Any, depth: int) -> Iterator[Part]:
    if type(value).__name__ == OPAQUE or not isinstance(value, np.ndarray) or depth > MAX_DEPTH:
        return
    if value.dtype.names is not None:
        if value.size > MOST_ELEMENTS:
            return
        for k, element in enumerate(value.reshape(-1)):
            at = path if value.size == 1 else (*path[:-1], f"{path[-1]}({k + 1})")
            labels = _labels(element)
            for name in value.dtype.names:
                for part in _parts((*at, name), element[name], depth + 1):
                    yield _labelled(part, labels) if name in ("values", "Data") else part
    elif value.dtype.kind == "O":
        for k, element in enumerate(value.reshape(-1)[:MOST_ELEMENTS]):
            at = path if value.size == 1 else (*path[:-1], f"{path[-1]}{{{k + 1}}}")
            yield from _parts(at, element, depth + 1)
    else:
        yield Part(path, value.shape, value.dtype, value.copy)


def _labels(element: Any) -> tuple[str, ...]:
    """Returns the label of a signal in a Simulink log ("structure with time")."""
    for name in ("label", "Name", "blockName"):
        if name in (element.dtype.names or ()):
            value = np.asarray(element[name])
            if value.size == 1 and value.dtype.kind == "U" and str(value.reshape(-1)[0]).strip():
                return (str(value.reshape(-1)[0]).strip(),)
    return ()


def _labelled(part: Part, labels: tuple[str, ...]) -> Part:
    """Returns a part under the label of its signal; its structure stays the same."""
    if len(labels) != 1:
        return part
    return Part((*part.path[:-2], labels[0]), part.shape, part.dtype, part.read, part.unit)
