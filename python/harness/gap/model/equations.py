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
    moved
        shape (n,), estimated parameter changes, within MOST_SIGMAS of the prior.
    noise
        shape (K,), change of the residual by one draw of sensor noise, in the unit of the equation.
    largest
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
    moved: FloatArray
    noise: FloatArray
    largest: float
    block: npt.NDArray[np.int64]
    independent: float

    @property
    def residual(self) -> FloatArray:
        """Residual after the regression divided by sigma, shape (K,)."""
        return np.asarray(self.rows + self.columns @ self.moved, dtype=np.float64)

    @property
    def is_loud(self) -> bool:
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
    told = all_values(rig, values)
    base = _stacked(signals, told, rig.plant)
    if not base:
        return ()
    noisy = _stacked([_with_noise(one, k) for k, one in enumerate(signals)], told, rig.plant)
    own = [
        *(_slope(signals, told, rig.plant, p) for p in calibration_parameters(rig)),
        *_zero_errors(signals, told, rig.plant),
    ]
    late, gas = "effects.transport_delay.delay_s", "nuisance.free_gas"
    unsure = [
        residuals(signals, {**told, name: value}, rig.plant)
        for name, value in ((late, told[late] + TIMING_S), (gas, FREE_GAS_TIMES * told[gas]))
    ]
    block = _blocks(signals)
    seconds = sum(one.command.size * one.dt_s - SKIP_S for one in signals)
    found = []
    for name, terms in base.items():
        residual = _sum(terms)
        noise = _sum(noisy[name]) - residual
        largest = max(float(np.sqrt(np.mean(term**2))) for term in terms.values())
        sigma = np.sqrt(
            np.mean(noise**2)
            + _tolerance(name, largest, told, rig.plant) ** 2
            + np.sum([(one[name] - residual) ** 2 for one in unsure], axis=0)
        )
        rows = residual / sigma
        concerned = [one for one in own if np.any(one.rows[name])]
        columns = np.array([one.rows[name] / sigma for one in concerned])
        columns = columns.reshape(-1, rows.size).T
        centre = np.array([one.centre for one in concerned])
        precision = np.array([one.sigma**-2 for one in concerned])
        reach = MOST_SIGMAS * precision**-0.5
        independent = INDEPENDENT_HZ * seconds
        weight = moved = np.zeros(centre.size)
        for _ in range(EQUATION_SETTLES):
            # The prior is weighted against n independent rows with the variance of the residual.
            variance = float(np.mean((rows + columns @ moved) ** 2)) + 1.0
            weight = variance * rows.size / independent * precision
            moved = regress(rows, columns, centre, weight, reach)
        found.append(
            Equation(
                name,
                rows,
                columns,
                sigma,
                centre,
                weight,
                moved,
                noise,
                largest,
                block,
                independent,
            )
        )
    return tuple(found)


def share_of(equation: Equation) -> EquationShare:
    """Residual and noise of an equation, as shares of its largest term."""
    rms = _rms(equation, equation.residual * equation.sigma / equation.largest)
    noise = float(np.sqrt(np.mean(equation.noise**2))) / equation.largest
    return EquationShare(equation.name, SUBSYSTEM[equation.name], rms, noise)


def _rms(equation: Equation, rows: FloatArray) -> Estimate:
    """Rms of the rows with its bootstrap interval."""
    squares, counts = np.bincount(equation.block, rows**2), np.bincount(equation.block)
    drawn = drawn_windows(counts.size, np.random.default_rng(0))
    ends = interval(np.sqrt(squares[drawn].sum(axis=1) / counts[drawn].sum(axis=1)))
    return Estimate(float(np.sqrt(np.mean(rows**2))), *ends)


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
    each = [servo_terms(one, values, plant) for one in signals]
    common = [name for name in each[0] if all(name in one for one in each)]
    return {
        name: {term: np.concatenate([one[name][term] for one in each]) for term in each[0][name]}
        for name in common
    }


def residuals(signals: Sequence[Measured], values: Values, plant: str) -> dict[str, FloatArray]:
    """Residuals of the equations at given values, in the unit of each equation, shape (K,) each."""
    return {name: _sum(terms) for name, terms in _stacked(signals, values, plant).items()}


def _sum(terms: Terms) -> FloatArray:
    return np.asarray(np.sum(list(terms.values()), axis=0), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Own:
    """A value that an equation may change: prior of its change, and slopes of the residuals."""

    centre: float
    sigma: float
    rows: Mapping[str, FloatArray]


def _slope(signals: Sequence[Measured], values: Values, plant: str, parameter: Parameter) -> _Own:
    """Slopes of the residuals with respect to a parameter, by a central difference.

    It extends over half a standard deviation of the prior, because rounded curves bend within one.
    The equations are linear in a value, or in its reciprocal, rather than in its logarithm. For a
    logarithm a change of two standard deviations has the size exp(2 sigma) - 1; half of it counts
    as one standard deviation.
    """
    x = parameter.place(values[parameter.name])
    reach = min(0.25 * parameter.sigma, 0.1 * (parameter.high - parameter.low))
    high, low = min(x + reach, parameter.high), max(x - reach, parameter.low)
    up = residuals(signals, {**values, parameter.name: parameter.value(high)}, plant)
    down = residuals(signals, {**values, parameter.name: parameter.value(low)}, plant)
    slopes = {name: (up[name] - down[name]) / (high - low) for name in up}
    sigma = parameter.sigma
    if parameter.logarithmic:
        sigma = 0.5 * math.expm1(2.0 * sigma)
    return _Own(parameter.centre - x, sigma, slopes)


def _zero_errors(signals: Sequence[Measured], values: Values, plant: str) -> list[_Own]:
    """Zero error of each pressure sensor, as a parameter of the regression.

    The unit of the parameter is ZERO_ERROR times the supply pressure.
    """
    if plant != "ehs":
        return []
    base = residuals(signals, values, plant)
    found = []
    for name in PRESSURES:
        if all(name in one.columns for one in signals):
            step = ZERO_ERROR * values["supply.pressure_pa"]
            moved = [
                replace(one, columns={**one.columns, name: one.columns[name] + step})
                for one in signals
            ]
            rows = residuals(moved, values, plant)
            found.append(_Own(0.0, 1.0, {key: rows[key] - base[key] for key in rows}))
    return found


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
    found: list[npt.NDArray[np.int64]] = []
    first = 0
    for one in signals:
        skipped = int(np.ceil(SKIP_S / one.dt_s))
        centres = WeakForm(one.dt_s, first=skipped).centres(one.command.size)
        number = ((centres - skipped) * one.dt_s / WINDOW_S).astype(np.int64)
        found.append(first + number)
        first += int(number[-1]) + 1
    return np.concatenate(found)
