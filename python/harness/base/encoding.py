# SPDX-License-Identifier: MIT
"""Converts results to plain values and to JSON, and their classes to JSON Schemas."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import math
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import msgspec.inspect
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

    The schema quotes the docstrings of the classes and of their fields. All numbers but whole ones
    may be null.
    """
    schema = _as_written(msgspec.json.schema(kind))
    for one in _classes(msgspec.inspect.type_info(kind), set()):
        properties = schema["$defs"][one.__name__]["properties"]
        for name, text in _field_texts(one).items():
            properties[name] = {"description": text, **properties[name]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}


def _classes(info: Any, seen: set[type]) -> set[type]:
    """Adds the classes of results that a type consists of to `seen`, and returns it."""
    if isinstance(info, msgspec.inspect.DataclassType | msgspec.inspect.StructType):
        if info.cls not in seen:
            seen.add(info.cls)
            for field in info.fields:
                _classes(field.type, seen)
        return seen
    parts = [getattr(info, name, None) for name in ("item_type", "key_type", "value_type")]
    for part in (*parts, *getattr(info, "types", ()), *getattr(info, "item_types", ())):
        if part is not None:
            _classes(part, seen)
    return seen


def _field_texts(kind: type) -> dict[str, str]:
    """Returns what stands below the fields of a class in its source, by field."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in itertools.pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }


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
