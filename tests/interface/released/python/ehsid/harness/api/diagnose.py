# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING
from ehsid.harness import gap, records
from ehsid.harness.api.wording import progress_of
from ehsid.harness.api.record import Source, record_of
from ehsid.harness.api.record import Record
from ehsid.harness.api.rig import Rig, RigSource, rig_of
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.wording import in_python, log_reading
from ehsid.harness.catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.files import result_folder
from ehsid.harness.gap.diagnosis_file import RESULT_FILES
from ehsid.harness.parallel import workers as using
from ehsid.harness.records import read_record
from ehsid.harness.records.telling_apart import told_apart
from ehsid.harness.report.gap_brief import brief_tables
from ehsid.harness.report.gap_words import VERDICTS, plain_name
from ehsid.harness.report.shares import percent
from ehsid.harness.report.text_table import TextTable
from ehsid.harness.rigs.checks import unknown
if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    from matplotlib.figure import Figure

class Diagnosis(Shown):

    def __init__(self, result: gap.Diagnosis, used: Sequence[records.Record], rig: Rig) -> None:
        ...

    @property
    def verdict(self) -> str:
        ...

    @property
    def sentence(self) -> str:
        ...

    @property
    def augmented_rig(self) -> Rig:
        ...

    def plot(self) -> Figure:
        ...

    def save(self, folder: str | os.PathLike[str]) -> Path:
        ...

    def to_polars(self) -> pl.DataFrame:
        ...

    def to_pandas(self) -> pd.DataFrame:
        ...

def diagnose(records: Source | Sequence[Source], rig: RigSource, *, validate: Source | Sequence[Source]=(), exclude: Sequence[str]=(), workers: int | None=None, progress: bool=True) -> Diagnosis:
    ...
