# SPDX-License-Identifier: MIT
"""Converts results to plain values and to JSON, and their classes to JSON Schemas."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

T = TypeVar("T")


def to_plain(value: Any) -> Any:
    """Converts a result to dicts with text keys, lists, numbers, text and None.

    A dataclass becomes a dict, an array or tuple a list, a complex number [real, imaginary], a
    slice [start, stop], and a number that is not finite None.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    if isinstance(value, slice):
        return [value.start, value.stop]
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if isinstance(value, complex):
        return to_plain([value.real, value.imag])
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_text(result: Any, *, indent: int = 2) -> str:
    """Returns a result of dataclasses or msgspec classes as JSON, with a line feed at its end.

    A field is a key; a number that is not finite becomes null.
    """
    return msgspec.json.format(msgspec.json.encode(result), indent=indent).decode() + "\n"


def from_json(
    content: bytes, kind: type[T], dec_hook: Callable[[type, Any], Any] | None = None
) -> T:
    """Returns what `json_text` wrote of a result of this class.

    dec_hook: makes values of classes that msgspec does not know, of the class and what was read.

    Raises
    ------
    msgspec.DecodeError
        the content is no JSON, or not of this class.
    """
    try:
        return msgspec.json.decode(content, type=kind, dec_hook=dec_hook)
    except RecursionError:
        raise msgspec.DecodeError(
            "brackets are nested too deeply: expected the few levels of a file of ehsid"
        ) from None


def read_json(path: Path, kind: type[T]) -> T | None:
    """Returns what a file has of this class; None where there is none, or it has another one."""
    try:
        return from_json(path.read_bytes(), kind)
    except (OSError, msgspec.DecodeError):
        return None


def json_schema(kind: type, title: str) -> dict[str, Any]:
    """Returns the JSON Schema of the text that `json_text` writes of a result of this class.

    The schema quotes the docstrings of the classes. All numbers but whole ones may be null.
    """
    schema = _as_written(msgspec.json.schema(kind))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}


def _as_written(schema: Any) -> Any:
    """Allows null beside numbers, and removes the indentation of docstrings."""
    match schema:
        case {"description": str(text), **others}:
            return {"description": inspect.cleandoc(text), **_as_written(others)}
        case {"type": "number", **others}:
            return {"type": ["number", "null"], **_as_written(others)}
        case dict():
            return {key: _as_written(value) for key, value in schema.items()}
        case list():
            return [_as_written(value) for value in schema]
    return schema
