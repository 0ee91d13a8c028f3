# SPDX-License-Identifier: MIT
"""Folder of a blind case: rig.toml, train.csv, validate.csv, and nothing of what is withheld."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.files import write_text

from .case import RealityCase

FILES = ("rig.toml", "train.csv", "validate.csv")
FORMATS = {
    "time_s": "%.6g",
    "command_v": "%.5f",
    "position_m": "%.7f",
    "spool": "%.5f",
}


def record_text(record: Mapping[str, npt.NDArray[np.float64]]) -> str:
    """Returns the record as CSV text with a header line."""
    text = io.StringIO()
    np.savetxt(
        text,
        np.column_stack(list(record.values())),
        fmt=[FORMATS.get(name, "%.0f") for name in record],
        delimiter=",",
        header=",".join(record),
        comments="",
    )
    return text.getvalue()


def write_case(case: RealityCase, folder: str | os.PathLike[str]) -> None:
    """Writes the three files of a case, each whole or not at all; creates the folder."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    texts = (case.rig_toml, record_text(case.train), record_text(case.validate))
    for name, text in zip(FILES, texts, strict=True):
        write_text(target / name, text)
