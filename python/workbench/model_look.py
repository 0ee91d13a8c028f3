# SPDX-License-Identifier: MIT
"""What the page draws of an identified model; kept in a file, and the signals as pyramids.

The numbers are those of `identification`; here they are only brought together.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.identification import IdentificationResult, IoData
from ehsid.harness.models.identification.dynamics import Dynamics, dynamics
from ehsid.harness.records import Record
from ehsid.harness.show.model_blocks import ModelTold, model_line, model_told
from ehsid.harness.show.model_curves import Bode, Lags, lags, model_bode

from .downsampling import make_pyramid, store
from .session import Session

FILE = "identified.json"
MEASURED, SIMULATED, RESIDUAL = "measured", "simulated", "residual"


class Identified(msgspec.Struct, frozen=True):
    """An identified model, as the page shows it.

    Attributes
    ----------
    record, input_name, output_name
        what it was made of.
    line, told
        which model was chosen, and what is told of it.
    dynamics
        its poles and zeros.
    whiteness, independence, bode
        what is drawn of it.
    """

    record: str
    input_name: str
    output_name: str
    line: str
    told: ModelTold
    dynamics: Dynamics
    whiteness: Lags
    independence: Lags
    bode: Bode


def look_folder(session: Session) -> Path:
    """Returns the folder of what the page draws of models; no record can have its name."""
    return session.folder / "looks" / "_model"


def write_look(
    session: Session, record: Record, result: IdentificationResult, data: IoData
) -> None:
    """Writes what the page draws of an identification of a record."""
    folder = look_folder(session)
    folder.mkdir(parents=True, exist_ok=True)
    free, ahead = result.simulated, result.one_step
    first, last = int(free.index[0]), int(free.index[-1]) + 1  # only the half that is judged by
    np.save(folder / f"{TIME}.npy", times_of(record)[first:last])
    for name, index, values in (
        (MEASURED, free.index, free.measured),
        (SIMULATED, free.index, free.predicted),
        (RESIDUAL, ahead.index, ahead.residual),
    ):
        whole = np.full(last - first, np.nan)
        whole[index - first] = np.where(np.isfinite(values), values, np.nan)
        store(make_pyramid(whole), folder, name)
    shown = Identified(
        record.name,
        data.input_name,
        data.output_name,
        model_line(result),
        model_told(result, data.input_name, data.output_name, usual=True),
        dynamics(result.chosen.model, result.dt_s),
        lags(result.whiteness),
        lags(result.independence),
        model_bode(result, data),
    )
    write_text(folder / FILE, json_text(shown))


def times_of(record: Record) -> FloatArray:
    """Returns the times of all samples of a record in s."""
    if record.time_s is not None:
        return record.time_s
    return (record.dt_s or 1.0) * np.arange(len(record), dtype=np.float64)


def read_look(session: Session) -> Identified | None:
    """Returns what the page draws of the last identification; None without one."""
    return read_json(look_folder(session) / FILE, Identified)
