# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from ehsid.harness import records
from ehsid.harness.api.tables import Tabular
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.wording import in_python, in_python_words
from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.files import result_files
from ehsid.harness.records.formats import format_of
from ehsid.harness.records.record import unit_of
from ehsid.harness.records.writing import record_bytes
from ehsid.harness.report.text_table import TextTable
if TYPE_CHECKING:
    from matplotlib.figure import Figure
MOST_NAMED = 8

class Record(Shown, Tabular):

    def __init__(self, result: records.Record) -> None:
        ...

    @property
    def name(self) -> str:
        ...

    @property
    def dt_s(self) -> float | None:
        ...

    @property
    def time_s(self) -> FloatArray | None:
        ...

    @property
    def columns(self) -> Mapping[str, FloatArray]:
        ...

    def plot(self) -> Figure:
        ...

    def save(self, path: str | os.PathLike[str]) -> Path:
        ...
