# SPDX-License-Identifier: MIT
"""Attribution of the gap to subsystems, from equations or position errors, without any fit.

The effect with the largest gain (the strongest suspect) is put into the equations of the measured
signals, and all effects are tried again, until none gains enough. Gains are in nats per independent
statistic, as are the logarithms of the residuals that remain above the noise. Both are added up to
shares of the subsystems. Without equations one suspect is taken, from the position errors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.inference.maps import window_numbers_of
from ehsid.harness.gap.inference.suspects import Suspect, suspects
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
    INDEPENDENT_HZ,
    LOST_PHASE,
    MOST_SUSPECTS,
    SUSPECT_GAIN,
    SUSPECT_NEAR,
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
        what they leave over before any suspect; empty without the measurements for them.
    taken
        suspects that were put into the equations, in this order.
    subsystem
        share of the gap by subsystem, sum 1; empty where nothing is above the noise, or where the
        data do not show it.
    notes
        sentences for the reader.
    """

    equations: tuple[EquationShare, ...]
    taken: tuple[Suspect, ...]
    subsystem: Mapping[str, float]
    notes: tuple[str, ...]


def attribute_equations(
    records: Sequence[Record], rig: Rig, values: Mapping[str, float], exclude: Sequence[str] = ()
) -> Attribution:
    """Attributes the gap from the equations of the measured signals.

    `exclude` holds ids of effects that are not tried; for the other parameters see `equations`.
    """
    signals = [measured(record, rig) for record in records]
    told = all_values(rig, values)
    found = equations(records, rig, told)
    first = tuple(share_of(equation) for equation in found)
    taken: list[Suspect] = []
    weights: dict[str, float] = {}
    notes: list[str] = []
    for _ in range(MOST_SUSPECTS):
        asked = suspects(
            found,
            partial(_changed, signals, told, rig.plant),
            rig,
            [*exclude, *(one.effect for one in taken)],
        )
        if not asked or asked[0].gain < SUSPECT_GAIN:
            break
        taken.append(asked[0])
        notes += _share_out(weights, asked)
        told |= asked[0].values
        found = equations(records, rig, told)
    for equation in found:
        if not equation.exceeds_tolerance:
            continue
        share = share_of(equation)
        times = float(np.sqrt(np.mean(equation.residual**2)))
        whose: tuple[str, ...] = (share.subsystem,)
        if any(effects()[one.effect].subsystem == "sensor" for one in taken):
            # The effect of a sensor on the position can be undone only in part.
            whose = ("sensor",)
        elif share.equation in (CAP, ROD):
            # The flow that is wrong may be that of the valve or another one.
            whose = ("valve", "hydraulics")
        for subsystem in whose:
            _add(weights, subsystem, math.log(times) / len(whose))
        # What a suspect leaves over (friction within the smoothing of the speed) is not new.
        if not set(whose) <= {effects()[one.effect].subsystem for one in taken}:
            notes.append(
                f'The equation "{share.equation}" is left with {times:.1f} times what it may be '
                "off, whatever effect of the catalogue is put in."
            )
    return Attribution(first, tuple(taken), _shares(weights), tuple(notes))


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
    spread = np.concatenate([one.centred(one.outputs["position_m"]) for one in problem.records])
    block = window_numbers_of(problem.records)
    apart = max(1, round(WEAK_FORM_S / problem.records[0].dt_s))
    same = block[apart:] == block[:-apart]
    speeds = [float(np.std((one[apart:] - one[:-apart])[same])) for one in (rows, spread)]
    if speeds[0] > LOST_PHASE * speeds[1]:
        note = (
            f"The speed of the calibrated simulation is off by {100.0 * speeds[0] / speeds[1]:.0f} "
            "% of the rod's: its errors do not say to what subsystem they belong."
        )
        return Attribution((), (), {}, (note,))
    found = _error_equation(problem, x, rows)

    def change(effect: Mapping[str, float]) -> Mapping[str, FloatArray]:
        changed = Problem(
            problem.rig,
            problem.records,
            problem.parameters,
            outputs=("position_m",),
            floors=problem.floors,
            substeps=problem.substeps,
            fixed=effect,
        )
        return {found.name: changed.errors(x)["position_m"]}

    asked = suspects([found], change, problem.rig, exclude)
    taken = asked[:1] if asked and asked[0].gain >= SUSPECT_GAIN else ()
    if not taken:
        return Attribution((), (), {}, ())
    weights: dict[str, float] = {}
    notes = _share_out(weights, asked)
    return Attribution((), tuple(taken), _shares(weights), tuple(notes))


def _changed(
    signals: Sequence[Measured],
    values: Mapping[str, float],
    plant: str,
    effect: Mapping[str, float],
) -> Mapping[str, FloatArray]:
    return residuals(signals, {**values, **effect}, plant)


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


def _share_out(weights: dict[str, float], asked: Sequence[Suspect]) -> list[str]:
    """Adds the strongest gain, in equal parts, to the subsystems of all nearly as strong suspects.

    Returns a sentence that says so where there are several subsystems.
    """
    near = [one for one in asked if one.gain >= SUSPECT_NEAR * asked[0].gain]
    whose = sorted({effects()[one.effect].subsystem for one in near})
    for subsystem in whose:
        _add(weights, subsystem, asked[0].gain / len(whose))
    if len(whose) == 1:
        return []
    listed = ", ".join(one.effect for one in near)
    return [f"Without a fit these are alike: {listed}; the gap is shared among their subsystems."]


def _add(weights: dict[str, float], subsystem: str, weight: float) -> None:
    weights[subsystem] = weights.get(subsystem, 0.0) + weight


def _shares(weights: Mapping[str, float]) -> dict[str, float]:
    total = sum(weights.values())
    return {name: weight / total for name, weight in weights.items()} if total > 0.0 else {}
