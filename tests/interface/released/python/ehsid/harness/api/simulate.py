# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
import numpy as np
import numpy.typing as npt
from ehsid.harness import records, simulation
from ehsid.harness.api.tables import Tabular
from ehsid.harness.api.record import record_of
from ehsid.harness.api.record import Record
from ehsid.harness.api.rig import Rig, RigSource, rig_of
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.wording import in_python, log_reading
from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.channels import COMMAND, REQUIRED_COLUMNS
from ehsid.harness.excitation.named import SIGNALS
from ehsid.harness.files import result_files
from ehsid.harness.records import read_record
from ehsid.harness.records.formats import format_of
from ehsid.harness.records.writing import record_bytes
from ehsid.harness.report.model_tables import run_table
from ehsid.harness.report.text_table import TextTable
from ehsid.harness.simulation import SimulationRun, draw_noise
from ehsid.harness.simulation.logged_command import logged_command
from ehsid.harness.simulation.signal_options import SignalOptions, as_command, check_start
if TYPE_CHECKING:
    from matplotlib.figure import Figure
DT_S = 0.001
DURATION_S = 10.0

class Simulation(Shown, Tabular):

    def __init__(self, result: SimulationRun, rig: Rig) -> None:
        ...

    @property
    def record(self) -> Record:
        ...

    def plot(self) -> Figure:
        ...

    def save(self, path: str | os.PathLike[str]) -> Path:
        ...

def simulate(rig: RigSource, command: str | os.PathLike[str] | Record | records.Record | npt.ArrayLike, *, dt_s: float | None=None, duration_s: float=DURATION_S, amplitude: float | None=None, values: Mapping[str, float] | None=None, noise: bool=False, seed: int=0, position0_m: float | None=None) -> Simulation:
    ...
