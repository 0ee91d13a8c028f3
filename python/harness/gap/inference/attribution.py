# SPDX-License-Identifier: MIT
"""What the equations of measured signals, or the errors of a position, say of effects one by one.

The strongest suspect is put into the equations, which are then asked again, until nothing gains.
Gains are in nats per independent statistic, as are the logarithms of what remains above the noise,
so that both make shares of the subsystems.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ehsid.harness.arrays import FloatArray
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
from ehsid.harness.rigs.parameters import effects


@dataclass(frozen=True)
class Attribution:
    """What was found without any fit.

    Attributes
    ----------
    equations
        before any suspect; empty without pressures.
    taken
        those that were put in one after another.
    subsystem
        shares, sum 1; empty where nothing is above the noise, or nothing can be told.
    notes
        sentences.
    """

    equations: tuple[EquationShare, ...]
    taken: tuple[Suspect, ...]
    subsystem: Mapping[str, float]
    notes: tuple[str, ...]


def attribute_equations(
    records: Sequence[Record], rig: Rig, values: Mapping[str, float], exclude: Sequence[str] = ()
) -> Attribution:
    """From measured pressures; see `equations` for the parameters."""
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
        if not equation.is_loud:
            continue
        share = share_of(equation)
        times = float(np.sqrt(np.mean(equation.residual**2)))
        whose: tuple[str, ...] = (share.subsystem,)
        if any(effects()[one.effect].subsystem == "sensor" for one in taken):
            # What a sensor did to the position is undone by halves only.
            whose = ("sensor",)
        elif share.equation in (CAP, ROD):
            # May be a flow of the valve as well as another.
            whose = ("valve", "hydraulics")
        for subsystem in whose:
            _add(weights, subsystem, math.log(times) / len(whose))
        # Friction within the smoothing of the speed, or a sensor's own: no news.
        if not set(whose) <= {effects()[one.effect].subsystem for one in taken}:
            notes.append(
                f'The equation "{share.equation}" is left with {times:.1f} times what it may be '
                "off, whatever effect of the catalogue is put in."
            )
    return Attribution(first, tuple(taken), _shares(weights), tuple(notes))


def attribute_errors(problem: Problem, x: FloatArray, exclude: Sequence[str] = ()) -> Attribution:
    """From the calibrated errors of the position, to first order about the calibration.

    Parameters
    ----------
    problem
        of the calibration alone.
    x
        where it ended.
    exclude
        ids that are not asked for.
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
    """The errors as an equation whose own values are those of the calibration."""
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
    """The strongest gain, in equal parts to the subsystems of all that gain nearly as much.

    Says so where they are several.
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
