# SPDX-License-Identifier: MIT
"""Determines the format of a file from its name."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ehsid.harness.records.errors import RecordError

Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# "csv.gz" is a format of its own: a name such as "rec.csv.gz" matches no other ending.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")


def format_of(path: Path) -> Format:
    """Returns the format that belongs to the ending of the name, in upper or lower case.

    Raises
    ------
    RecordError
        the ending is unknown.
    """
    for ending in FORMATS:
        if path.name.lower().endswith("." + ending):
            return ending
    listed = ", ".join("." + ending for ending in sorted(FORMATS))
    raise RecordError(
        path,
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension",
        expected=f"one of {listed}",
        mend="export or convert the record to one of these formats",
    )


def stem_of(path: Path) -> str:
    """Returns the name without the ending of its format: "run.csv.gz" gives "run"."""
    return path.name[: -len(format_of(path)) - 1]
