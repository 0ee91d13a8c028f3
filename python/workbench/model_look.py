# SPDX-License-Identifier: MIT
"""What the page draws of an identified model; kept in a file, and the signals as pyramids.

The numbers are those of `identification`; here they are only brought together.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.identification import (
    IdentificationResult,
    IoData,
    frequency_response,
    power_band,
    response_grid,
)
from ehsid.harness.models.identification.dynamics import Dynamics, dynamics
from ehsid.harness.models.identification.residuals import IndependenceTest, WhitenessTest
from ehsid.harness.records import Record
from ehsid.harness.show.model_blocks import ModelTold, model_line, model_told

from .downsampling import make_pyramid, store
from .session import Session

FILE = "identified.json"
MEASURED, SIMULATED, RESIDUAL = "measured", "simulated", "residual"


class Correlation(msgspec.Struct, frozen=True):
    """A residual test: the correlation at each lag in samples, and the 99 % band of one lag."""

    lags: list[int]
    values: list[float]
    band: float


class Bode(msgspec.Struct, frozen=True):
    """Magnitude in dB and phase in degrees over the frequency, each with its 95 % band."""

    frequency_hz: list[float]
    magnitude_db: list[float]
    magnitude_low: list[float]
    magnitude_high: list[float]
    phase_deg: list[float]
    phase_low: list[float]
    phase_high: list[float]
    excited_hz: tuple[float, float]


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
    whiteness: Correlation
    independence: Correlation
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
        _correlation(result.whiteness),
        _correlation(result.independence),
        _bode(result, data),
    )
    write_text(folder / FILE, json_text(shown))


def times_of(record: Record) -> FloatArray:
    """Returns the times of all samples of a record in s."""
    if record.time_s is not None:
        return record.time_s
    return (record.dt_s or 1.0) * np.arange(len(record), dtype=np.float64)


def read_look(session: Session) -> Identified | None:
    """Returns what the page draws of the last identification; None without one."""
    try:
        return from_json((look_folder(session) / FILE).read_bytes(), Identified)
    except (OSError, msgspec.DecodeError):
        return None


def _correlation(test: WhitenessTest | IndependenceTest) -> Correlation:
    return Correlation(test.lags.tolist(), test.correlation.tolist(), test.band)


def _bode(result: IdentificationResult, data: IoData) -> Bode:
    dt_s = data.dt_s or 1.0
    grid = response_grid(result.n_validation, dt_s)
    response = frequency_response(result.chosen.model, grid, dt_s)
    magnitude, phase = response.magnitude_band_db(), response.phase_band_deg()

    def plain(values: FloatArray) -> list[float]:
        finite: list[float] = np.nan_to_num(values, nan=0.0, posinf=1e4, neginf=-1e4).tolist()
        return finite

    return Bode(
        grid.tolist(),
        plain(response.magnitude_db),
        plain(magnitude[:, 0]),
        plain(magnitude[:, 1]),
        plain(response.phase_deg),
        plain(phase[:, 0]),
        plain(phase[:, 1]),
        power_band(data),
    )
