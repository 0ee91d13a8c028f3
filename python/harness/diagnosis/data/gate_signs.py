# SPDX-License-Identifier: MIT
"""Gate for signs: direction of command and position, and assignment of the pressure ports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from ...base.arrays import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES
from ...records import Record
from ...records.mapping import how_to_exchange
from ...rigs import Rig
from ..schema import Remark
from .cylinder import areas, oil_spring_hz
from .sensor_floor import SPRING_HIDES_NOISE

# With a correlation of command and speed below minus this value, the signs are certainly opposite.
# Oil springs and limit cycles turn the phase, but on the whole by less than half a turn.
OPPOSITE = 0.3
# The position is smoothed over this time for the force balance; an oil spring of 20 Hz is kept.
FORCE_SMOOTHED_S = 0.02
# The chamber pressures may be exchanged if the exchange leaves less than this share of the force
# that the columns as named leave unexplained.
EXCHANGED = 0.3
# A sign is certain where the value is this many of its standard deviations: because a refusal must
# be certain, a false one may occur in some ten thousand records only. The deviations come from this
# many blocks of a record.
PORTS_DEVIATIONS = 4.0
BLOCKS = 10


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


def jackknife(terms: FloatArray, force: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Weights of least squares, from all samples and from all but each of BLOCKS blocks.

    Neighbouring samples are not independent; blocks of a tenth of the record nearly are (B. Efron,
    The Jackknife, the Bootstrap and Other Resampling Plans, SIAM 1982).

    Parameters
    ----------
    terms, force
        shape (N, n) and (N,), terms of order one.
    """
    blocks = np.array_split(np.arange(force.size), BLOCKS)
    squares = [terms[block].T @ terms[block] for block in blocks]
    products = [terms[block].T @ force[block] for block in blocks]

    def weights(left_out: int | None) -> FloatArray:
        kept = [index for index in range(BLOCKS) if index != left_out]
        square = np.sum([squares[index] for index in kept], axis=0)
        product = np.sum([products[index] for index in kept], axis=0)
        return np.asarray(np.linalg.lstsq(square, product, rcond=1e-12)[0])

    return weights(None), [weights(index) for index in range(BLOCKS)]


def check_directions(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that a positive command extends the rod, by the correlation of command and speed."""
    command, speed = record.column("command_v"), _slopes(record, 1)
    if np.ptp(command) == 0.0 or np.ptp(speed) == 0.0:
        return
    # The means are subtracted, because the mean command may hold a load.
    coefficient = correlation(command, speed)
    if coefficient > -OPPOSITE:
        return
    yield Remark(
        record.name,
        f"the rod moves against the command (correlation {coefficient:.2f}): position counts "
        "from the cap end, and a positive command must extend; change the sign of one of them",
        serious=True,
    )


def check_ports(record: Record, rig: Rig) -> Iterator[Remark]:
    """Compares the force balance with the pressures as named and with the pressures exchanged.

    They are exchanged for certain only where the columns as named contradict mechanics and the
    other way round agrees with it: a load has a positive mass, and its friction takes power.
    """
    if rig.plant != "ehs" or any(name not in record.columns for name in CHAMBER_PRESSURES):
        return
    p_a, p_b = (record.column(name) for name in CHAMBER_PRESSURES)
    if np.ptp(p_a) == 0.0 or np.ptp(p_b) == 0.0 or np.ptp(record.column("position_m")) == 0.0:
        return
    spring_hz = oil_spring_hz(rig)
    assert record.dt_s is not None
    if spring_hz is not None and spring_hz * record.dt_s > SPRING_HIDES_NOISE:
        return  # the positions do not show the acceleration that the pressures cause
    cap, annulus = areas(rig.values)
    as_named = _balance(record, cap * p_a - annulus * p_b)
    exchanged = _balance(record, cap * p_b - annulus * p_a)
    fits_better = exchanged.residual < EXCHANGED * as_named.residual
    contradicts = max(as_named.mass, as_named.friction) < -PORTS_DEVIATIONS
    agrees = exchanged.mass > PORTS_DEVIATIONS and exchanged.friction > -PORTS_DEVIATIONS
    if agrees and (fits_better or (contradicts and exchanged.friction > PORTS_DEVIATIONS)):
        yield Remark(
            record.name,
            "pressure_a_pa and pressure_b_pa are exchanged: only the other way round do they "
            "balance the motion; A is the cap side. Exchange the two columns: "
            f"{how_to_exchange(record, rig.columns, *CHAMBER_PRESSURES)}",
            serious=True,
        )
    elif min(as_named.mass, as_named.friction) < -PORTS_DEVIATIONS:
        yield Remark(
            record.name,
            "the net force of pressure_a_pa and pressure_b_pa acts against the motion, as if "
            "the load had a negative mass or its friction gave power; check which pressure is "
            "which, and the bore and the rod in the rig file",
        )


@dataclass(frozen=True)
class _Balance:
    """Force balance: rms of the residual, N; mass and power of friction in their deviations."""

    residual: float
    mass: float
    friction: float


def _balance(record: Record, force: FloatArray) -> _Balance:
    """Fits the force balance, with the deviations of a jackknife over blocks of the record.

    m a + b v + F_c sgn v + k y + F_0 = F,   power of friction = mean of (b v + F_c sgn v) v
    """
    speed, acceleration = _slopes(record, 1), _slopes(record, 2)
    terms = np.column_stack(
        [acceleration, speed, np.sign(speed), record.column("position_m"), np.ones(len(record))]
    )
    size = np.abs(terms).max(axis=0)
    terms = terms / np.where(size > 0.0, size, 1.0)
    scaled_force = force / np.abs(force).max()
    power = np.array([np.mean(terms[:, 1] * speed), np.mean(terms[:, 2] * speed)])
    whole, parts = jackknife(terms, scaled_force)

    def signs(weights: FloatArray) -> FloatArray:
        return np.array([weights[0], power @ weights[1:3]])

    deviations = np.sqrt((BLOCKS - 1) * np.var([signs(part) for part in parts], axis=0))
    mass, friction = signs(whole) / np.maximum(deviations, 1e-300)
    residual = float(np.std(scaled_force - terms @ whole) * np.abs(force).max())
    return _Balance(residual, float(mass), float(friction))
