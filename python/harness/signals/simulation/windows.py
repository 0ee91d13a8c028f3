# SPDX-License-Identifier: MIT
"""Simulates a rig on a logged command in short windows.

A free run of a servo over the whole record would show only its drift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

import ehsid

from ...base.numbers import FloatArray
from ...catalogue.parameters import plant_parameters
from ...records import Record
from ...rigs import Rig
from .run import OUTPUTS_OF, prepare

# States that can be set at the start of a window, in the order of `aligned` in ehsid.simulate_plant
STATES = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")

# Over this time the motion of a servo is nearly a cubic polynomial. An oscillation of the oil
# spring at 70 Hz keeps 95 % of its speed, and the sensor noise averages out.
SMOOTHED_S = 0.01
SMOOTHED_ORDER = 3


@dataclass(frozen=True, eq=False)
class WindowedRun:
    """Outputs for several sets of values in the windows of one record."""

    outputs: Mapping[str, FloatArray]
    """Arrays of shape (M, N) by name, of M sets and N samples, for all outputs of the plant."""
    sensitivities: Mapping[str, FloatArray]
    """Arrays of shape (M, N, S) by name: derivatives with respect to the S varied values."""
    window: npt.NDArray[np.int64]
    """Window number of each sample, shape (N,); -1 before the first window."""


def window_numbers(
    samples: int, dt_s: float, *, window_s: float, skip_s: float
) -> npt.NDArray[np.int64]:
    """Window number of each sample, shape (samples,); -1 in the first `skip_s` seconds."""
    if not (window_s >= 2.0 * dt_s and 0.0 <= skip_s < samples * dt_s):
        raise ValueError(
            f"window_s = {window_s:g}, skip_s = {skip_s:g}: expected windows of at least two "
            f"samples ({2.0 * dt_s:g} s) and a start within the record ({samples * dt_s:g} s)"
        )
    length, skipped = round(window_s / dt_s), math.ceil(skip_s / dt_s * (1.0 - 1e-12))
    return np.maximum((np.arange(samples) - skipped) // length, -1)


def measured_states(record: Record) -> FloatArray:
    """Returns the states that a record gives, in the order of STATES; NaN for a missing column.

    The result has the shape (N, 4). The position and the pressures are those of the record. So is
    the speed where it was measured; otherwise it is the slope of a cubic fitted to the position
    over 10 ms around the sample (Savitzky, Golay, Anal. Chem. 36(8), 1964).
    """
    dt_s = _checked_sampling(record)
    states = np.full((len(record), len(STATES)), np.nan)
    for i, name in enumerate(STATES):
        if name in record.columns:
            states[:, i] = record.column(name)
    if "velocity_m_s" not in record.columns:
        length = min(max(5, 2 * round(0.5 * SMOOTHED_S / dt_s) + 1), len(record) - 1 | 1)
        states[:, 1] = savgol_filter(
            record.column("position_m"), length, polyorder=SMOOTHED_ORDER, deriv=1, delta=dt_s
        )
    return states


def simulate_windows(
    rig: Rig,
    record: Record,
    *,
    window_s: float = 0.5,
    skip_s: float = 0.3,
    reset: Literal["carry", "estimate"] = "carry",
    value_sets: Sequence[Mapping[str, float]] = ({},),
    varied: Sequence[str] = (),
    substeps: int | None = None,
    threads: int = 0,
) -> WindowedRun:
    """Simulates a rig on the command of a record, reset to the measurement at each window's start.

    Parameters
    ----------
    rig
        rig to simulate.
    record
        record without gaps, with `command_v` and `position_m`.
    window_s, skip_s
        length of a window, s; time that is skipped at the start of the record, s.
    reset
        "carry": only the position is set to its measured value; all other states continue from the
        previous window. "estimate": speed and pressures are set, too, as far as `measured_states`
        gives them. The states that depend on the command alone (delay line, spool, play of the
        valve) always continue.
    value_sets
        M mappings of full names to values that replace those of the rig; they run in parallel.
    varied
        S full names of the values for which sensitivities are computed.
    substeps
        integration steps in each sample; by default the minimum for the rig's fastest oscillation.
    threads
        number of threads; 0 uses one for each core.

    Raises
    ------
    ValueError
        the record has gaps or lacks a column, a name is unknown, or the window is too short.
    SimulationError
        the rig cannot be simulated.
    """
    dt_s = _checked_sampling(record)
    names = list(plant_parameters())
    unknown = sorted(set(varied) - set(names))
    if unknown:
        raise ValueError(f"'{unknown[0]}' is no value of the plant")
    window = window_numbers(len(record), dt_s, window_s=window_s, skip_s=skip_s)
    states = measured_states(record)
    window_starts = np.flatnonzero(np.diff(window, prepend=-2) > 0)
    aligned = np.full_like(states, np.nan)
    # No earlier state exists that the first sample could continue from.
    aligned[0] = states[0]
    reset_states = slice(0, 1) if reset == "carry" else slice(None)
    aligned[window_starts, reset_states] = states[window_starts, reset_states]

    plant_value_sets = [
        prepare(rig, dt_s=dt_s, values=values, substeps=substeps or 2).plant_values
        for values in value_sets
    ]
    if substeps is None:
        substeps = max(ehsid.plant_substeps(rig.plant, values, dt_s) for values in plant_value_sets)
    outputs, sensitivities = ehsid.simulate_plant(
        rig.plant,
        np.hstack([np.array(plant_value_sets), np.tile(rig.table_values(), (len(value_sets), 1))]),
        record.column("command_v"),
        dt_s=dt_s,
        substeps=substeps,
        varied=[names.index(name) for name in varied],
        aligned=aligned,
        threads=threads,
        tables=rig.table_shapes(),
    )
    output_names = OUTPUTS_OF[rig.plant]
    columns = [OUTPUTS_OF["ehs"].index(name) for name in output_names]
    return WindowedRun(
        {name: outputs[..., i] for name, i in zip(output_names, columns, strict=True)},
        {name: sensitivities[..., i] for name, i in zip(output_names, columns, strict=True)},
        window,
    )


def _checked_sampling(record: Record) -> float:
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(
            f"{record.source or record.name}: windows need one stretch with a sampling time; cut "
            "the record at its gaps"
        )
    return record.dt_s
