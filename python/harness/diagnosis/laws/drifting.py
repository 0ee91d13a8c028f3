# SPDX-License-Identifier: MIT
"""Values of the rig that change in the course of the records, as where the oil warms.

One value for all windows cannot follow oil that warms: viscous friction and leakage change by half
in 20 K, and the bulk modulus with them. No term of an equation over the time is like that, because
friction that fades is no force over the time. A leakage that grows is most like one that does not,
so that a constant one is named, and only its growth tells that this is not all. Here each value of
the rig and of the effects has, besides, a share that grows with the time, zero in the middle of the
longest record. Its derivative is that of the value in a window, times the time of the window:
values act within a window, so that exact sensitivities of one point suffice, and nothing is
simulated again.

Sound machines whose excitation changes in the course of a record, such as a chirp, could seem to
drift, because errors depend on frequency and amplitude. The fitted and the held-out records have
excitations of their own. Only a change that makes the errors of both smaller counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray, plain_number
from ...catalogue.channels import TIME
from ...catalogue.parameters import name_in_sentence
from ...catalogue.spellings import ParameterKey
from ..deciding import DRIFT_SIGMA, DRIFTS
from ..model.case import Case
from ..model.fit import hats
from ..model.parameters import Law
from ..model.problem import Problem
from ..model.separation import Quadratic, quadratic, reweighted
from ..search.candidates import FittedCandidate, decision_case
from .forms import laws as laws_of_menu

# Other values are told where they explain this share of what the best one does.
AS_GOOD = 0.6
MOST_TOLD = 3
# What the warming of the oil changes in the course of any record, as a standard deviation of the
# logarithm: mineral oil loses about 3 % of its viscosity with each kelvin, and much less of its
# stiffness. Up to ORDINARY_SIGMAS of it are no evidence.
ORDINARY = {
    "load.viscous_friction_n_s_m": 0.1,
    "axis.viscous_friction_n_s_m": 0.1,
    "fluid.bulk_modulus_pa": 0.02,
}
ORDINARY_SIGMAS = 2.0
SUPPLY = "effects.supply_droop."


@dataclass(frozen=True)
class Drift:
    """Values that change in the course of the records."""

    gain: float
    """By which the errors become smaller in the fitted or in the held-out data, ln on the average,
    whichever is less."""
    changes: tuple[tuple[str, float], ...]
    """Values any of which explains most of it alone, the best first: full name, and relative change
    over the longest record."""

    @property
    def sentence(self) -> str:
        """What changes, for the reader."""
        told = []
        for name, change in self.changes:
            went = "rose" if change > 0.0 else "fell"
            told.append(
                f"{name_in_sentence(name)} {went} by {plain_number(100.0 * abs(change), 2)} %"
            )
        return (
            "Values change in the course of the records, as where the oil warms: it is most nearly "
            f"as if {', or '.join(told)}."
        )


def values_that_drift(case: Case, best: FittedCandidate) -> Drift | None:
    """Values of the rig and of effects that change with the time; None where none does.

    best: the fit of the rig with the best set of effects, or without any. On a user's simulator
    none is looked for.
    """
    if case.engine is not None:
        return None
    parameters = case.parameters(best.effects)
    own = [
        place
        for place, each in enumerate(parameters)
        if each.logarithmic and each.low < each.high and _may_change(each.name)
    ]
    errors = _linearised(case, best, own=own)
    if not own or errors is None:
        return None
    gain = errors.gain()
    if not gain >= DRIFTS:
        return None
    size = len(parameters)
    without, _ = errors.left(range(size))
    alone = [errors.left([*range(size), size + each]) for each in range(len(own))]
    gains = [float(np.mean(without - each)) for each, _ in alone]
    order = sorted(range(len(own)), key=lambda each: -gains[each])
    return Drift(
        gain,
        tuple(
            (parameters[own[each]].name, math.expm1(float(alone[each][1][size])))
            for each in order[:MOST_TOLD]
            if gains[each] >= AS_GOOD * gains[order[0]]
        ),
    )


def explains_more(case: Case, best: FittedCandidate, drift: Drift) -> bool:
    """Whether a drift beside the best set explains more than any law over the time beside it.

    The laws are compared in the same way, by the sensitivities where they are zero.
    """
    fine = decision_case(case)
    over_time = [law for law in laws_of_menu(fine, best) if law.of == TIME]
    errors = [_linearised(case, best, law=law) for law in over_time]
    return all(each is None or each.gain() <= drift.gain for each in errors)


@dataclass(frozen=True, eq=False)
class _Errors:
    """Squares of the errors of the fitted and of the held-out data, linear in all parameters.

    `size`: number of parameters of the best set; those of its drift, or of a law, are behind them.
    """

    parts: tuple[Quadratic, Quadratic]
    size: int
    information: FloatArray
    offset: FloatArray
    bounds: FloatArray
    ordinary: Mapping[int, float]
    """Standard deviation of a drift that is in every servo, by its place."""

    def left(self, places: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Errors of both parts with these parameters alone, ln, and the changes of them."""
        kept = np.array(places)
        some = [_restricted(part, kept) for part in self.parts]
        _, change = reweighted(
            _joined(some), self.information[kept], self.offset[kept], *self.bounds[kept].T
        )
        return np.array([_left(each, change) for each in some]), change

    def as_in_every_servo(self) -> FloatArray:
        """Errors of both parts without drift but the ordinary one, ln."""
        information, bounds = self.information.copy(), self.bounds.copy()
        for place, sigma in self.ordinary.items():
            information[place] = sigma**-2
            bounds[place] = np.array([-1.0, 1.0]) * ORDINARY_SIGMAS * sigma
        servo = replace(self, information=information, bounds=bounds)
        return servo.left([*range(self.size), *self.ordinary])[0]

    def gain(self) -> float:
        """By which all make the errors smaller, ln, in the part in which it is less."""
        without = self.as_in_every_servo()
        return float(np.min(without - self.left(range(self.offset.size))[0]))


def _linearised(
    case: Case, best: FittedCandidate, *, own: Sequence[int] = (), law: Law | None = None
) -> _Errors | None:
    """The errors beside the best set; None where they are not finite.

    own: places of the parameters that have a share that grows with the time. law: a law that is
    zero.
    """
    fine, laws = decision_case(case), () if law is None else (law,)
    problems = [
        fine.problem(best.effects, held_out=held_out, laws=laws) for held_out in (False, True)
    ]
    longest_s = max(record.dt_s * len(record.record) for p in problems for record in p.records)
    x = np.concatenate([best.x, np.zeros(sum(each.knots.size for each in laws))])
    fitted, held_out = (_with_time(problem, x, own, longest_s) for problem in problems)
    if not all(np.isfinite(part.grams).all() for part in (fitted, held_out)):
        return None
    bounds = np.array([(p.low, p.high) for p in problems[0].parameters]) - x[:, np.newaxis]
    information = problems[0].information()
    offset = np.where(information > 0.0, x - problems[0].centres(), 0.0)
    return _Errors(
        (fitted, held_out),
        best.x.size,
        np.concatenate([information, np.full(len(own), DRIFT_SIGMA**-2)]),
        np.concatenate([offset, np.zeros(len(own))]),
        np.concatenate([bounds, np.full((len(own), 2), np.inf) * (-1.0, 1.0)]),
        {
            best.x.size + each: ORDINARY[name]
            for each, name in enumerate(problems[0].parameters[place].name for place in own)
            if name in ORDINARY
        },
    )


def _may_change(name: str) -> bool:
    """Whether a value may change within minutes: not one of steel, nor one of our simulator.

    The pressure of a pump with a relief valve bends over the flow. Where the flow grows in the
    course of a record, a droop that is proportional to it would seem to grow as well.
    """
    return not (ParameterKey(name).is_nuisance or name.startswith(("cylinder.", SUPPLY)))


def _with_time(problem: Problem, x: FloatArray, own: Sequence[int], longest_s: float) -> Quadratic:
    """Squares of the errors by all parameters, and by a share of these that grows with the time."""
    middles = []
    for record in problem.records:
        length = record.full_windows[1]
        middles.append((hats(record).begins + 0.5 * length) * record.dt_s / longest_s - 0.5)
    over_time = np.concatenate(middles)[problem.spectrum.window_of_rows()]
    linear = problem.linear(x)
    slopes = {name: rows[:, own] * over_time[:, np.newaxis] for name, rows in linear.slopes.items()}
    return quadratic(problem, linear.joined(linear.errors, slopes))


def _restricted(errors: Quadratic, kept: npt.NDArray[np.int64]) -> Quadratic:
    grams = errors.grams[:, kept][:, :, kept]
    return replace(errors, products=errors.products[:, kept], grams=grams)


def _joined(parts: list[Quadratic]) -> Quadratic:
    names = ("squares", "products", "grams", "rows", "independent", "tolerated")
    return Quadratic(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _left(errors: Quadratic, change: FloatArray) -> float:
    """Mean of ln(errors / tolerated errors) behind a change, as of `search.score.left`."""
    power = errors.power_after(change)
    excess = 0.5 * errors.independent * np.log1p(power / errors.tolerated)
    return float(excess.sum() / errors.independent.sum())
