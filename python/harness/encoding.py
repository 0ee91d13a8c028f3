# SPDX-License-Identifier: MIT
"""Converts results to plain values that `json.dumps` accepts."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


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
