# SPDX-License-Identifier: MIT
"""Attributes of a dataset that change its values, by the convention of netCDF.

value = stored * scale_factor + add_offset. `_FillValue`, `missing_value` and the valid range are
in the numbers that are stored, and tell which of them are no values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import RecordError

Unpack = Callable[[npt.NDArray[Any]], npt.NDArray[Any]]

SCALES = ("scalefactor", "addoffset")
MISSING = ("fillvalue", "missingvalue")
RANGES = ("validmin", "validmax", "validrange")
# Attributes of other conventions, whose formula is not known.
UNKNOWN = ("scale", "scaling", "gain", "factor", "slope", "multiplier", "offset", "intercept",
           "bias", "calibration", "unsigned")  # fmt: skip
NEUTRAL = (0.0, 1.0)


def unpacking(attributes: Mapping[str, Any], name: str, path: Path, notes: list[str]) -> Unpack:
    """Returns what makes values of the stored numbers of a dataset, and adds a note on it.

    It raises RecordError where an attribute cannot be applied, once the dataset is read.
    """
    known: dict[str, tuple[str, npt.NDArray[np.float64] | None]] = {}
    foreign = []
    for key in attributes:
        plain = "".join(c for c in key.casefold() if c.isalnum())
        if plain in (*SCALES, *MISSING, *RANGES):
            known[plain] = key, _numbers(attributes[key])
        elif plain in UNKNOWN:
            found = _numbers(attributes[key])
            if found is None or not np.isin(found, NEUTRAL).all():
                foreign.append(f"{key} = {str(attributes[key])[:40]}")
    if foreign:
        notes.append(
            f"'{name}' has attributes of unknown meaning, which are not applied: "
            + ", ".join(foreign)
        )
    if not known:
        return lambda stored: stored
    sizes = {**dict.fromkeys((*SCALES, "validmin", "validmax"), 1), "validrange": 2}
    bad = [key for plain, (key, found) in known.items()
           if found is None or found.size != sizes.get(plain, found.size)]  # fmt: skip
    if not bad:
        words = (f"{key} = {', '.join(f'{x:.9g}' for x in v)}"
                 for key, v in known.values() if v is not None)  # fmt: skip
        notes.append(f"'{name}': attributes of the file are applied: {'; '.join(words)}")

    def unpack(stored: npt.NDArray[Any]) -> npt.NDArray[Any]:
        if bad:
            raise RecordError(
                path,
                f"the attribute {bad[0]}, which changes the values, is not understood: "
                f"{str(attributes[bad[0]])[:60]}",
                column=name,
                expected="one number (two for a valid range)",
                mend="apply it before the export, and remove the attribute",
            )
        if stored.dtype.kind not in "fiub":
            return stored
        of = {plain: found for plain, (_, found) in known.items() if found is not None}
        values = stored.astype(np.float64)
        low, high = of.get("validrange", (-np.inf, np.inf))
        low, high = of.get("validmin", [low])[0], of.get("validmax", [high])[0]
        missing = (values < low) | (values > high)
        for plain in MISSING:
            # As float32 stores it, a number such as 9.96921e36 is not the one of the attribute.
            given = of.get(plain, np.empty(0))
            missing |= np.isin(values, given) | np.isin(values, given.astype(np.float32))
        values = values * of.get("scalefactor", [1.0])[0] + of.get("addoffset", [0.0])[0]
        values[missing] = np.nan
        return values

    return unpack


def _numbers(value: Any) -> npt.NDArray[np.float64] | None:
    """Returns the numbers of an attribute, which may be a number, an array, or text; else None."""
    if isinstance(value, bytes):
        value = value.decode("ascii", "replace")
    try:
        found = np.asarray(value).reshape(-1).astype(np.float64)
    except (TypeError, ValueError):
        return None
    return found if found.size else None
