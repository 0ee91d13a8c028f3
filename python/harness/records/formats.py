# SPDX-License-Identifier: MIT
"""Which file name means which format."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ehsid.harness.records.errors import RecordError

Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# The longer ending first: "rec.csv.gz" ends in neither ".csv" nor another format.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")


def format_of(path: Path) -> Format:
    """The format that the ending of the name stands for, in either case.

    Raises
    ------
    RecordError
        an unknown ending.
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
    """The name without the ending of its format: "run.csv.gz" gives "run"."""
    return path.name[: -len(format_of(path)) - 1]
