# SPDX-License-Identifier: MIT
"""What one log tells of what is watched: effects, values of the rig, and K, omega_n, xi.

Every log is fitted with the same effects, named or not, so that their sizes can be compared over
months. The deviations are those within a log; what the simulator is wrong by is the same in all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ..base.parallel import single_threaded_algebra
from ..catalogue.parameters import effects as catalogue
from ..catalogue.parameters import plant_parameters
from ..catalogue.spellings import ParameterKey
from ..diagnosis.data.gate import gate, usable_part
from ..diagnosis.model.case import Case, make_case
from ..diagnosis.search.candidates import (
    FittedCandidate,
    calibrate,
    linearised_start,
    refine,
    screen,
)
from ..diagnosis.search.gap_reduction import mean_gap
from ..diagnosis.search.intervals import candidate_covariance
from ..diagnosis.search.search import candidate_effects
from ..models.estimation.servo import estimate_servo
from ..models.identification import IoData
from ..records import Record
from ..rigs import Rig

# Effects by which servos wear: seals, edges and guides, and the null of the valve.
WEAR = ("internal_leakage", "coulomb_friction", "valve_dead_band", "valve_null_bias")
# A value is told by a log if its deviation is at most this share of that of the rig file.
INFORMED = 0.8
# The gap that stays scatters by at least this share from log to log.
OF_GAP = 0.02
GAP = "gap.stays"
SERVO = {"K": "servo.K", "omega_n": "servo.omega_n", "xi": "servo.xi"}


@dataclass(frozen=True)
class Estimated:
    """A quantity as one log shows it."""

    quantity: str
    """Full name of a value or of a parameter of an effect, `servo.*`, or `GAP`."""
    unit: str
    value: float
    deviation: float
    """Standard deviation within the log, > 0."""


@dataclass(frozen=True)
class Told:
    """What one log tells; `refused` says why it tells nothing."""

    estimates: tuple[Estimated, ...] = ()
    temperature_c: float | None = None
    """Mean temperature of the oil, if it is logged."""
    refused: str = ""


def tracked_effects(rig: Rig, wanted: Sequence[str] = WEAR) -> tuple[str, ...]:
    """Returns those of the effects that the plant of the rig can have and the rig file does not."""
    possible = candidate_effects(rig)
    return tuple(effect for effect in wanted if effect in possible)


def estimated(record: Record, rig: Rig, effects: Sequence[str]) -> Told:
    """Fits one log and returns what it tells.

    Parameters
    ----------
    record
        with `command_v` and `position_m`.
    rig
        configuration of the simulator.
    effects
        ids of the effects whose sizes are watched.
    """
    serious = [remark.what for remark in gate([record], rig) if remark.serious]
    if serious:
        return Told(refused=serious[0])
    used = usable_part(record, rig)[0]
    temperature = None
    if "temperature_c" in used.columns:
        temperature = float(np.nanmean(used.column("temperature_c")))
    try:
        with single_threaded_algebra():
            case = make_case(rig, [used])
            told = (*_of_fit(case, _fitted(case, effects)), *_of_servo(used))
    except ValueError as error:
        return Told(temperature_c=temperature, refused=str(error))
    return Told(told, temperature)


def _fitted(case: Case, effects: Sequence[str]) -> FittedCandidate:
    """Adds the effect that helps most, then the next one: a wrong first one is a wrong minimum."""
    fitted, left = calibrate(case), list(effects)
    while left:
        start = linearised_start(case, fitted.effects, fitted.x)
        tried = [screen(case, (*fitted.effects, effect), [start]) for effect in left]
        fitted = min(tried, key=lambda each: each.cost)
        left.remove(fitted.effects[-1])
    return refine(case, fitted.effects, fitted.x) if effects else fitted


def _of_fit(case: Case, fitted: FittedCandidate) -> list[Estimated]:
    # A size of zero is an end of its range; it has the deviation of one that is free to move.
    covariance, _ = candidate_covariance(case, fitted, at_ends=True)
    told = []
    for parameter, x, variance in zip(
        case.parameters(fitted.effects), fitted.x, np.diag(covariance), strict=True
    ):
        key, deviation = ParameterKey(parameter.name), math.sqrt(max(float(variance), 0.0))
        is_known = 0.0 < deviation < INFORMED * parameter.sigma
        if key.is_nuisance or not is_known or _is_form(key):
            continue
        value = parameter.value(float(x))
        unit = plant_parameters()[key].unit
        told.append(Estimated(key, unit, value, abs(parameter.slope(float(x))) * deviation))
    gap = mean_gap(fitted.sums)
    return [*told, Estimated(GAP, "1", gap, OF_GAP * gap)]


def _is_form(key: ParameterKey) -> bool:
    """Whether a parameter is the form of an effect, not its size."""
    if key.effect is None:
        return False
    info = next(p for p in catalogue()[key.effect].parameters if p.name == key.parameter)
    return info.power == 0.0


def _of_servo(record: Record) -> list[Estimated]:
    path = estimate_servo(IoData.from_record(record, "command_v", "position_m"), 1)
    if path is None:
        return []
    per_deviation = float(norm.ppf(0.95))
    return [
        Estimated(
            SERVO[value.name],
            value.unit or "1",
            float(value.path[value.at]),
            float(value.half_path[value.at]) / per_deviation,
        )
        for value in path
        if value.trusted and value.half_path[value.at] > 0.0
    ]
