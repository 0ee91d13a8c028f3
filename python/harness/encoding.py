# SPDX-License-Identifier: MIT
"""Results as plain values that `json.dumps` takes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def to_plain(value: Any) -> Any:
    """Dataclasses to dicts, keys to text, arrays to lists, non-finite numbers to None.

    Complex numbers become [real, imaginary].
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
