# SPDX-License-Identifier: MIT
"""Attribution of the gap to subsystems, from equations or position errors, without any fit.

The effect with the largest gain (the first of the ranking) is put into the equations of the
measured signals, and all effects are tried again, until none gains enough. Gains are in nats per
independent statistic, as are the logarithms of the residuals that remain above the noise. Both
are added up to shares of the subsystems. Without equations a single effect is included, from the
position errors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.inference.effect_ranking import RankedEffect, rank_effects
from ehsid.harness.gap.inference.maps import window_numbers_of
from ehsid.harness.gap.model.equations import (
    Equation,
    equations,
    residuals,
    share_of,
)
from ehsid.harness.gap.model.inverse_servo import CAP, ROD
from ehsid.harness.gap.model.inverse_signals import Measured, all_values, measured
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.schema import EquationShare
from ehsid.harness.gap.thresholds import (
    EQUAL_GAIN_SHARE,
    INDEPENDENT_HZ,
    LEAST_RANKED_GAIN,
    LOST_PHASE,
    MOST_RANKED_EFFECTS,
    WEAK_FORM_S,
)
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig


@dataclass(frozen=True)
class Attribution:
    """Result of the attribution without any fit of effects.

    Attributes
    ----------
    equations
        their residuals before any effect is included; empty without the measurements for them.
    included
        effects that were put into the equations, in this order.
    subsystem
        share of the gap by subsystem, sum 1; empty where nothing is above the noise, or where the
        data do not show it.
    notes
        sentences for the reader.
    """

    equations: tuple[EquationShare, ...]
    included: tuple[RankedEffect, ...]
    subsystem: Mapping[str, float]
    notes: tuple[str, ...]


def attribute_equations(
    records: Sequence[Record], rig: Rig, values: Mapping[str, float], exclude: Sequence[str] = ()
) -> Attribution:
    """Attributes the gap from the equations of the measured signals.

    `exclude` holds ids of effects that are not tried; for the other parameters see `equations`.
    """
    signals = [measured(record, rig) for record in records]
    current = all_values(rig, values)
    servo_equations = equations(records, rig, current)
    first_shares = tuple(share_of(equation) for equation in servo_equations)
    included: list[RankedEffect] = []
    weights: dict[str, float] = {}
    notes: list[str] = []
    for _ in range(MOST_RANKED_EFFECTS):
        ranked = rank_effects(
            servo_equations,
            partial(_changed, signals, current, rig.plant),
            rig,
            [*exclude, *(ranked_effect.effect for ranked_effect in included)],
        )
        if not ranked or ranked[0].gain < LEAST_RANKED_GAIN:
            break
        included.append(ranked[0])
        notes += _distribute(weights, ranked)
        current |= ranked[0].values
        servo_equations = equations(records, rig, current)
    for equation in servo_equations:
        if not equation.exceeds_tolerance:
            continue
        share = share_of(equation)
        ratio = float(np.sqrt(np.mean(equation.residual**2)))
        subsystems: tuple[str, ...] = (share.subsystem,)
        if any(effects()[ranked_effect.effect].subsystem == "sensor" for ranked_effect in included):
            # The effect of a sensor on the position can be undone only in part.
            subsystems = ("sensor",)
        elif share.equation in (CAP, ROD):
            # The flow that is wrong may be that of the valve or another one.
            subsystems = ("valve", "hydraulics")
        for subsystem in subsystems:
            _add(weights, subsystem, math.log(ratio) / len(subsystems))
        # The rest that an included effect leaves (friction within the smoothing of the speed) is
        # not a further gap.
        if not set(subsystems) <= {
            effects()[ranked_effect.effect].subsystem for ranked_effect in included
        }:
            notes.append(
                f'The equation "{share.equation}" is left with {ratio:.1f} times what it may be '
                "off, whatever effect of the catalogue is put in."
            )
    return Attribution(first_shares, tuple(included), _shares(weights), tuple(notes))


def attribute_errors(problem: Problem, x: FloatArray, exclude: Sequence[str] = ()) -> Attribution:
    """Attributes the gap from the calibrated position errors, linearised about the calibration.

    Parameters
    ----------
    problem
        problem of the calibration alone, without effects.
    x
        parameters at the end of its fit, shape (n,).
    exclude
        ids of effects that are not tried.
    """
    rows = problem.errors(x)["position_m"]
    spread = np.concatenate(
        [record.centred(record.outputs["position_m"]) for record in problem.records]
    )
    block = window_numbers_of(problem.records)
    lag = max(1, round(WEAK_FORM_S / problem.records[0].dt_s))
    same_window = block[lag:] == block[:-lag]
    speeds = [
        float(np.std((signal[lag:] - signal[:-lag])[same_window])) for signal in (rows, spread)
    ]
    if speeds[0] > LOST_PHASE * speeds[1]:
        note = (
            f"The speed of the calibrated simulation is off by {100.0 * speeds[0] / speeds[1]:.0f} "
            "% of the rod's: its errors do not say to what subsystem they belong."
        )
        return Attribution((), (), {}, (note,))
    equation = _error_equation(problem, x, rows)

    change = partial(_changed_errors, problem, x, equation.name)
    ranked = rank_effects([equation], change, problem.rig, exclude)
    included = ranked[:1] if ranked and ranked[0].gain >= LEAST_RANKED_GAIN else ()
    if not included:
        return Attribution((), (), {}, ())
    weights: dict[str, float] = {}
    notes = _distribute(weights, ranked)
    return Attribution((), tuple(included), _shares(weights), tuple(notes))


def _changed(
    signals: Sequence[Measured],
    values: Mapping[str, float],
    plant: str,
    effect: Mapping[str, float],
) -> Mapping[str, FloatArray]:
    return residuals(signals, {**values, **effect}, plant)


def _changed_errors(
    problem: Problem, x: FloatArray, name: str, effect: Mapping[str, float]
) -> Mapping[str, FloatArray]:
    changed = Problem(
        problem.rig,
        problem.records,
        problem.parameters,
        outputs=("position_m",),
        floors=problem.floors,
        substeps=problem.substeps,
        fixed=effect,
    )
    return {name: changed.errors(x)["position_m"]}


def _error_equation(problem: Problem, x: FloatArray, rows: FloatArray) -> Equation:
    """Returns the position errors as an equation with the calibrated values as its own."""
    parameters = problem.parameters
    columns = np.empty((rows.size, x.size))
    for i, parameter in enumerate(parameters):
        step = 1e-3 * min(parameter.sigma, parameter.high - parameter.low)
        step = step if x[i] + step <= parameter.high else -step
        moved = x.copy()
        moved[i] += step
        columns[:, i] = (problem.errors(moved)["position_m"] - rows) / step
    independent = INDEPENDENT_HZ * sum(record.seconds for record in problem.records)
    precision = np.array([parameter.sigma**-2 for parameter in parameters])
    sigma = np.full(rows.size, problem.floors["position_m"])
    variance = float(np.mean((rows / sigma) ** 2)) + 1.0
    centre = np.array([parameter.centre for parameter in parameters]) - x
    return Equation(
        "position_m",
        rows / sigma,
        columns / sigma[:, np.newaxis],
        sigma,
        centre,
        variance * rows.size / independent * precision,
        np.zeros(x.size),
        np.zeros(rows.size),
        float(np.sqrt(np.mean(rows**2))),
        window_numbers_of(problem.records),
        independent,
    )


def _distribute(weights: dict[str, float], ranked: Sequence[RankedEffect]) -> list[str]:
    """Adds the largest gain, in equal parts, to the subsystems of all effects with a similar gain.

    Returns a sentence that says so where there are several subsystems.
    """
    equal_gain = [
        ranked_effect
        for ranked_effect in ranked
        if ranked_effect.gain >= EQUAL_GAIN_SHARE * ranked[0].gain
    ]
    subsystems = sorted({effects()[ranked_effect.effect].subsystem for ranked_effect in equal_gain})
    for subsystem in subsystems:
        _add(weights, subsystem, ranked[0].gain / len(subsystems))
    if len(subsystems) == 1:
        return []
    names = ", ".join(ranked_effect.effect for ranked_effect in equal_gain)
    return [f"Without a fit these are alike: {names}; the gap is shared among their subsystems."]


def _add(weights: dict[str, float], subsystem: str, weight: float) -> None:
    weights[subsystem] = weights.get(subsystem, 0.0) + weight


def _shares(weights: Mapping[str, float]) -> dict[str, float]:
    total = sum(weights.values())
    return {name: weight / total for name, weight in weights.items()} if total > 0.0 else {}
