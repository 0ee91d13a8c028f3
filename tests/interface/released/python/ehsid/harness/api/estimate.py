# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
import numpy.typing as npt
import ehsid
from ehsid.harness import estimation
from ehsid.harness.api.tables import Tabular, time_column
from ehsid.harness.api.record import Source
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.simulate import Arrays, Signals, about, signals_of
from ehsid.harness.api.wording import in_python
from ehsid.harness.catalogue.policies import POLICIES
from ehsid.harness.encoding import to_plain
from ehsid.harness.estimation import EstimationResult, structure
from ehsid.harness.estimation.advice import Advice, advise
from ehsid.harness.estimation.recursion import START_VARIANCE, Recursion
from ehsid.harness.estimation.words import advice_words
from ehsid.harness.files import result_folder
from ehsid.harness.records.errors import nearest_name
from ehsid.harness.report.model_file_names import ESTIMATION_FILES
from ehsid.harness.report.model_tables import estimation_lines, parameter_table
from ehsid.harness.report.text_table import TextTable
if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

class Estimation(Shown, Tabular):

    def __init__(self, result: EstimationResult, signals: Signals, recursion: Recursion) -> None:
        ...

    @property
    def parameters(self) -> dict[str, float]:
        ...

    def to_control(self) -> control.TransferFunction:
        ...

    def plot(self) -> Figure:
        ...

    def save(self, folder: str | os.PathLike[str]) -> Path:
        ...

def estimate(record: Source | Arrays, *, input: str='command_v', output: str='position_m', na: int=3, nb: int=3, nk: int=1, forgetting: str | ehsid.Forgetting='exponential', method: str='rls', reset: bool=True, guards: ehsid.RlsOptions | None=None, start_variance: float=START_VARIANCE) -> Estimation:
    ...
