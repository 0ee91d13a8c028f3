# SPDX-License-Identifier: MIT
"""Gate for signs: direction of command and position, and assignment of the pressure ports."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.channels import CHAMBER_PRESSURES
from ehsid.harness.gap.schema import Remark
from ehsid.harness.gap.thresholds import EXCHANGED, FORCE_SMOOTHED_S, OPPOSITE
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig


def _slopes(record: Record, order: int) -> FloatArray:
    """Derivative of the position from a parabola fitted over FORCE_SMOOTHED_S, in SI units."""
    assert record.dt_s is not None
    length = max(5, 2 * round(0.5 * FORCE_SMOOTHED_S / record.dt_s) + 1)
    return np.asarray(
        savgol_filter(
            record.column("position_m"), length, polyorder=2, deriv=order, delta=record.dt_s
        ),
        dtype=np.float64,
    )


def _deviation(values: FloatArray) -> FloatArray:
    """Deviation from the mean, in units of the largest value, so that squares are of order one."""
    scaled = values / np.abs(values).max()
    return np.asarray(scaled - scaled.mean(), dtype=np.float64)


def correlation(first: FloatArray, second: FloatArray) -> float:
    """Returns the correlation coefficient of two signals in any unit.

    `np.corrcoef` squares the values without scaling, which loses very small and very large ones.

    Parameters
    ----------
    first, second
        shape (N,); each has a value other than zero.

    Returns
    -------
    float
        -1 to 1; 0 where a signal is constant.
    """
    a, b = _deviation(first), _deviation(second)
    size = np.sqrt((a @ a) * (b @ b))
    return float(a @ b / size) if size > 0.0 else 0.0


def check_directions(record: Record, rig: Rig) -> list[Remark]:
    """Checks that a positive command extends the rod, by the correlation of command and speed."""
    command, speed = record.column("command_v"), _slopes(record, 1)
    if np.ptp(command) == 0.0 or np.ptp(speed) == 0.0:
        return []
    # The means are subtracted, because the mean command may hold a load.
    coefficient = correlation(command, speed)
    if coefficient > -OPPOSITE:
        return []
    return [
        Remark(
            record.name,
            f"the rod moves against the command (correlation {coefficient:.2f}): position counts "
            "from the cap end, and a positive command must extend; change the sign of one of them",
            serious=True,
        )
    ]


def check_ports(record: Record, rig: Rig) -> list[Remark]:
    """Compares the force balance with the pressures as named and with the pressures exchanged."""
    if rig.plant != "ehs" or any(name not in record.columns for name in CHAMBER_PRESSURES):
        return []
    p_a, p_b = (record.column(name) for name in CHAMBER_PRESSURES)
    if np.ptp(p_a) == 0.0 or np.ptp(p_b) == 0.0:
        return []
    cap = 0.25 * np.pi * rig.values["cylinder.bore_m"] ** 2
    annulus = cap - 0.25 * np.pi * rig.values["cylinder.rod_m"] ** 2
    speed, acceleration = _slopes(record, 1), _slopes(record, 2)
    # m a = p_a A_a - p_b A_b - b v - F_c sgn v - k y - F_0: the right columns leave little of it.
    terms = np.column_stack(
        [acceleration, speed, np.sign(speed), record.column("position_m"), np.ones(len(record))]
    )
    scale = np.abs(terms).max(axis=0)
    terms = terms / np.where(scale > 0.0, scale, 1.0)
    as_named, exchanged = (
        _balance(terms, cap * cap_pressure - annulus * rod_pressure)
        for cap_pressure, rod_pressure in ((p_a, p_b), (p_b, p_a))
    )
    # With nearly equal areas an exchange changes the sign of the force. Then the sign of the fitted
    # mass decides.
    wrong = exchanged[0] < EXCHANGED * as_named[0] or (
        as_named[1] < 0.0 < exchanged[1] and as_named[2] > 0.5 and exchanged[0] < 1.5 * as_named[0]
    )
    if not wrong:
        return []
    return [
        Remark(
            record.name,
            "pressure_a_pa and pressure_b_pa are exchanged: only the other way round do they "
            "balance the motion; A is the cap side",
            serious=True,
        )
    ]


def _balance(terms: FloatArray, force: FloatArray) -> tuple[float, float, float]:
    """Fits terms to a force; returns the residual rms, the first weight and the explained share."""
    weights, *_ = np.linalg.lstsq(terms, force, rcond=None)
    residual = float(np.std(force - terms @ weights))
    spread = float(np.std(force))
    return residual, float(weights[0]), 1.0 - (residual / spread) ** 2 if spread > 0.0 else 0.0
