# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
import numpy.typing as npt
from ehsid.harness import identification
from ehsid.harness.api.tables import Tabular, time_column
from ehsid.harness.api.record import Source
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.simulate import Arrays, Signals, about, signals_of
from ehsid.harness.api.wording import in_python
from ehsid.harness.files import result_folder
from ehsid.harness.identification import IdentificationResult
from ehsid.harness.identification.search_range import MOST_DELAY, MOST_ORDER, parse_range
from ehsid.harness.identification.selection import DEFAULT_DELAYS, DEFAULT_ORDERS
from ehsid.harness.report.dynamics_tables import model_table, root_table, servo_lines
from ehsid.harness.report.model_file_names import IDENTIFICATION_FILES
from ehsid.harness.report.model_tables import candidate_table, identification_lines
from ehsid.harness.report.text_table import TextTable
if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure
T = TypeVar('T')

class Identification(Shown, Tabular):

    def __init__(self, result: IdentificationResult, signals: Signals) -> None:
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

def identify(record: Source | Arrays, *, input: str='command_v', output: str='position_m', orders: int | str | Iterable[int | tuple[int, int]]=DEFAULT_ORDERS, delays: int | str | Iterable[int]=DEFAULT_DELAYS) -> Identification:
    ...
