# SPDX-License-Identifier: MIT
"""Residual of each equation of the servo, from measured signals and without a fit of effects.

Each equation has its own regression, of its residual at the given values on its slopes with respect
to the rig values and nuisances in it, with the priors of the calibration. Equations do not share
values, so that an effect in one of them cannot hide in another.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.channels import CHAMBER_PRESSURES, COMMAND, SUPPLY_PRESSURE
from ehsid.harness.gap.data.bootstrap import drawn_windows, interval
from ehsid.harness.gap.data.floor import noise_floor
from ehsid.harness.gap.model.inverse_servo import CAP, FORCE, ROD, SPOOL, SUPPLY, servo_terms
from ehsid.harness.gap.model.inverse_signals import Measured, Terms, all_values, areas, measured
from ehsid.harness.gap.model.parameters import Parameter, calibration_parameters
from ehsid.harness.gap.model.weak_form import WeakForm, regress
from ehsid.harness.gap.schema import EquationShare, Estimate
from ehsid.harness.gap.thresholds import (
    EQUATION_LOUD,
    EQUATION_SETTLES,
    EQUATION_TOLERANCE,
    FREE_GAS_TIMES,
    INDEPENDENT_HZ,
    MOST_SIGMAS,
    SEAL_TOLERANCE,
    SKIP_S,
    SUPPLY_TOLERANCE,
    TIMING_S,
    WINDOW_S,
    ZERO_ERROR,
)
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

Values = Mapping[str, float]

# The subsystem whose effects appear first in each equation.
SUBSYSTEM = {
    SPOOL: "valve",
    CAP: "hydraulics",
    ROD: "hydraulics",
    SUPPLY: "hydraulics",
    FORCE: "mechanics",
}


PRESSURES = (*CHAMBER_PRESSURES, SUPPLY_PRESSURE)


@dataclass(frozen=True, eq=False)
class Equation:
    """An equation over all records, after its regression with K rows and n parameters.

    Attributes
    ----------
    name
        name of the equation.
    rows
        shape (K,), residual at the given values divided by sigma; no unit.
    columns
        shape (K, n), slopes of the rows with respect to the equation's own parameters.
    sigma
        shape (K,), accepted deviation of a row, in the unit of the equation. It covers the noise,
        the model error of the equation for a real servo, a command that is late by TIMING_S, and
        FREE_GAS_TIMES the free gas near vacuum.
    centre, weight
        shape (n,), prior of the parameter changes in the regression: its mean, and its weight
        relative to squares of rows.
    changes
        shape (n,), estimated parameter changes, within MOST_SIGMAS of the prior.
    noise
        shape (K,), change of the residual by one draw of sensor noise, in the unit of the equation.
    largest_term
        rms of the largest term, in the unit of the equation.
    block
        shape (K,), number of the window of half a second to which a row belongs.
    independent
        number of independent rows.
    """

    name: str
    rows: FloatArray
    columns: FloatArray
    sigma: FloatArray
    centre: FloatArray
    weight: FloatArray
    changes: FloatArray
    noise: FloatArray
    largest_term: float
    block: npt.NDArray[np.int64]
    independent: float

    @property
    def residual(self) -> FloatArray:
        """Residual after the regression divided by sigma, shape (K,)."""
        return np.asarray(self.rows + self.columns @ self.changes, dtype=np.float64)

    @property
    def exceeds_tolerance(self) -> bool:
        """Whether the whole bootstrap interval of the rms of `residual` is above EQUATION_LOUD."""
        return _rms(self, self.residual).low > EQUATION_LOUD


def equations(records: Sequence[Record], rig: Rig, values: Values) -> tuple[Equation, ...]:
    """Regresses all equations for which every record has the measurements.

    Parameters
    ----------
    records
        records without gaps.
    rig
        the rig as configured in the rig file.
    values
        values that replace those of the rig, by full name.

    Raises
    ------
    ValueError
        a record has gaps.
    """
    signals = [measured(record, rig) for record in records]
    base = all_values(rig, values)
    terms_by_equation = _stacked(signals, base, rig.plant)
    if not terms_by_equation:
        return ()
    noisy = _stacked([_with_noise(record, k) for k, record in enumerate(signals)], base, rig.plant)
    regressors = [
        *(_regressor(signals, base, rig.plant, p) for p in calibration_parameters(rig)),
        *_zero_errors(signals, base, rig.plant),
    ]
    delay, gas = "effects.transport_delay.delay_s", "nuisance.free_gas"
    uncertain = [
        residuals(signals, {**base, name: value}, rig.plant)
        for name, value in ((delay, base[delay] + TIMING_S), (gas, FREE_GAS_TIMES * base[gas]))
    ]
    block = _blocks(signals)
    seconds = sum(record.command.size * record.dt_s - SKIP_S for record in signals)
    fitted = []
    for name, terms in terms_by_equation.items():
        residual = _sum(terms)
        noise = _sum(noisy[name]) - residual
        largest = max(float(np.sqrt(np.mean(term**2))) for term in terms.values())
        sigma = np.sqrt(
            np.mean(noise**2)
            + _tolerance(name, largest, base, rig.plant) ** 2
            + np.sum([(shifted[name] - residual) ** 2 for shifted in uncertain], axis=0)
        )
        rows = residual / sigma
        active = [regressor for regressor in regressors if np.any(regressor.slopes[name])]
        columns = np.array([regressor.slopes[name] / sigma for regressor in active])
        columns = columns.reshape(-1, rows.size).T
        centre = np.array([regressor.centre for regressor in active])
        precision = np.array([regressor.sigma**-2 for regressor in active])
        largest_changes = MOST_SIGMAS * precision**-0.5
        independent = INDEPENDENT_HZ * seconds
        weight = changes = np.zeros(centre.size)
        for _ in range(EQUATION_SETTLES):
            # The prior is weighted against n independent rows with the variance of the residual.
            variance = float(np.mean((rows + columns @ changes) ** 2)) + 1.0
            weight = variance * rows.size / independent * precision
            changes = regress(rows, columns, centre, weight, largest_changes)
        fitted.append(
            Equation(
                name,
                rows,
                columns,
                sigma,
                centre,
                weight,
                changes,
                noise,
                largest,
                block,
                independent,
            )
        )
    return tuple(fitted)


def share_of(equation: Equation) -> EquationShare:
    """Residual and noise of an equation, as shares of its largest term."""
    rms = _rms(equation, equation.residual * equation.sigma / equation.largest_term)
    noise = float(np.sqrt(np.mean(equation.noise**2))) / equation.largest_term
    return EquationShare(equation.name, SUBSYSTEM[equation.name], rms, noise)


def _rms(equation: Equation, rows: FloatArray) -> Estimate:
    """Rms of the rows with its bootstrap interval."""
    squares, counts = np.bincount(equation.block, rows**2), np.bincount(equation.block)
    draws = drawn_windows(counts.size, np.random.default_rng(0))
    bounds = interval(np.sqrt(squares[draws].sum(axis=1) / counts[draws].sum(axis=1)))
    return Estimate(float(np.sqrt(np.mean(rows**2))), *bounds)


def _tolerance(name: str, largest: float, values: Values, plant: str) -> float:
    """Model error of an equation that is accepted for a real servo, in the unit of the equation."""
    if name == SUPPLY:
        return SUPPLY_TOLERANCE * largest
    tolerance = EQUATION_TOLERANCE * largest
    if name == FORCE and plant == "ehs":
        tolerance += SEAL_TOLERANCE * values["supply.pressure_pa"] * areas(values)[0]
    return tolerance


def _stacked(signals: Sequence[Measured], values: Values, plant: str) -> dict[str, Terms]:
    """Terms of the equations that all records have; the records follow each other in the rows."""
    by_record = [servo_terms(record, values, plant) for record in signals]
    common = [name for name in by_record[0] if all(name in terms for terms in by_record)]
    return {
        name: {
            term: np.concatenate([terms[name][term] for terms in by_record])
            for term in by_record[0][name]
        }
        for name in common
    }


def residuals(signals: Sequence[Measured], values: Values, plant: str) -> dict[str, FloatArray]:
    """Residuals of the equations at given values, in the unit of each equation, shape (K,) each."""
    return {name: _sum(terms) for name, terms in _stacked(signals, values, plant).items()}


def _sum(terms: Terms) -> FloatArray:
    return np.asarray(np.sum(list(terms.values()), axis=0), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Regressor:
    """A value that an equation may change: prior of its change, and slopes of the residuals."""

    centre: float
    sigma: float
    slopes: Mapping[str, FloatArray]


def _regressor(
    signals: Sequence[Measured], values: Values, plant: str, parameter: Parameter
) -> _Regressor:
    """Slopes of the residuals with respect to a parameter, by a central difference.

    The difference extends over half a standard deviation of the prior, because curves such as
    rounded edges are not linear over a whole one.
    The equations are linear in a value, or in its reciprocal, rather than in its logarithm. For a
    logarithm a change of two standard deviations has the size exp(2 sigma) - 1; half of it counts
    as one standard deviation.
    """
    x = parameter.place(values[parameter.name])
    half_step = min(0.25 * parameter.sigma, 0.1 * (parameter.high - parameter.low))
    high, low = min(x + half_step, parameter.high), max(x - half_step, parameter.low)
    upper = residuals(signals, {**values, parameter.name: parameter.value(high)}, plant)
    lower = residuals(signals, {**values, parameter.name: parameter.value(low)}, plant)
    slopes = {name: (upper[name] - lower[name]) / (high - low) for name in upper}
    sigma = parameter.sigma
    if parameter.logarithmic:
        sigma = 0.5 * math.expm1(2.0 * sigma)
    return _Regressor(parameter.centre - x, sigma, slopes)


def _zero_errors(signals: Sequence[Measured], values: Values, plant: str) -> list[_Regressor]:
    """Zero error of each pressure sensor, as a parameter of the regression.

    The unit of the parameter is ZERO_ERROR times the supply pressure.
    """
    if plant != "ehs":
        return []
    before = residuals(signals, values, plant)
    regressors = []
    for name in PRESSURES:
        if all(name in record.columns for record in signals):
            step = ZERO_ERROR * values["supply.pressure_pa"]
            shifted = [
                replace(record, columns={**record.columns, name: record.columns[name] + step})
                for record in signals
            ]
            after = residuals(shifted, values, plant)
            regressors.append(
                _Regressor(0.0, 1.0, {key: after[key] - before[key] for key in after})
            )
    return regressors


def _with_noise(signals: Measured, seed: int) -> Measured:
    """Returns the signals with one more draw of noise, as large as the noise that they contain."""
    rng = np.random.default_rng(seed)
    columns = {
        name: column + noise_floor(column).value * rng.standard_normal(column.size)
        for name, column in signals.columns.items()
        if name != COMMAND
    }
    return Measured(signals.dt_s, signals.command, columns)


def _blocks(signals: Sequence[Measured]) -> npt.NDArray[np.int64]:
    blocks: list[npt.NDArray[np.int64]] = []
    first_block = 0
    for record in signals:
        skipped = int(np.ceil(SKIP_S / record.dt_s))
        centres = WeakForm(record.dt_s, first=skipped).centres(record.command.size)
        block = ((centres - skipped) * record.dt_s / WINDOW_S).astype(np.int64)
        blocks.append(first_block + block)
        first_block += int(block[-1]) + 1
    return np.concatenate(blocks)
