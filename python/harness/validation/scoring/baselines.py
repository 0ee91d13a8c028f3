# SPDX-License-Identifier: MIT
"""Baselines: what simpler methods would say, from the candidates of the same diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import Named, Said, Tried
from ehsid.harness.validation.scoring.right import Judgement, judge

# A method: what it says of a case; None where the file lacks the data that the method needs.
Way = Callable[[Scored], Said | None]


@dataclass(frozen=True)
class Baseline:
    """A method of diagnosis and its figures over the cases in which it could be applied."""

    name: str
    how: str
    figures: tuple[Figure, ...]


def diagnosis(case: Scored) -> Said | None:
    """Returns what the diagnosis itself said."""
    return case.said


def refit_only(case: Scored) -> Said | None:
    """Blames the values in the rig file and never an effect."""
    return replace(case.said, verdict="parameters", named=(), sets=(), subsystem={})


def best_fit(case: Scored) -> Said | None:
    """Names the set of effects with the lowest cost on the fitted records."""
    return _chosen(case, lambda one: one.fitted_cost)


def lowest_bic(samples: dict[str, float | None]) -> Way:
    """Method with the lowest BIC / 2 = cost + (k / 2) ln n (Schwarz, Ann. Statist. 6(2), 1978).

    `samples` has n by name of the case. The cost includes priors: those of the rig count alike for
    all sets, those of an effect's own sizes do not.
    """

    def way(case: Scored) -> Said | None:
        n = samples.get(case.name)
        if n is None:
            return None
        return _chosen(
            case,
            lambda one: (
                None
                if one.fitted_cost is None or one.free is None
                else one.fitted_cost + 0.5 * one.free * math.log(n)
            ),
        )

    return way


def largest_residual(case: Scored) -> Said | None:
    """Blames the subsystem of the equation with the largest residual over its noise.

    This needs measured pressures.
    """
    if not case.said.residuals:
        return None
    subsystem, _ = max(case.said.residuals, key=lambda one: one[1])
    return Said("outside_catalogue", subsystem={subsystem: 1.0}, gap=case.said.gap)


def _chosen(case: Scored, cost: Callable[[Tried], float | None]) -> Said | None:
    costs = [(found, one) for one in case.said.tried if (found := cost(one)) is not None]
    if not costs:
        return None
    best = min(costs, key=lambda pair: pair[0])[1]
    if not best.effects:
        return replace(case.said, verdict="parameters", named=(), sets=(), subsystem={})
    named = tuple(Named(effect, 1.0) for effect in best.effects)
    known = effects().get(best.effects[0])
    blamed = {known.subsystem: 1.0} if known else {}
    return replace(case.said, verdict="effects", named=named, sets=(), subsystem=blamed)


def baselines(cases: Sequence[Scored], samples: dict[str, float | None]) -> tuple[Baseline, ...]:
    """Returns all methods, judged by the same rules; `samples` is that of `lowest_bic`."""
    return (
        _judged("this diagnosis", "as it was run", diagnosis, cases),
        _judged("refit only", "values of the rig, never an effect", refit_only, cases),
        _judged("best fit in sample", "lowest cost on the fitted record", best_fit, cases),
        _judged(
            "BIC", "lowest cost + k/2 ln n, n = 20 a second and output", lowest_bic(samples), cases
        ),
        Baseline(
            "largest residual",
            "equation that leaves most over its noise; needs pressures",
            (_subsystem_first(_tried(largest_residual, cases)),),
        ),
    )


def _tried(way: Way, cases: Sequence[Scored]) -> list[tuple[Scored, Judgement]]:
    return [(case, judge(case.answer, said)) for case in cases if (said := way(case)) is not None]


def _subsystem_first(found: Sequence[tuple[Scored, Judgement]]) -> Figure:
    return share("subsystem first", [j.subsystem_first for _, j in found])


def _judged(name: str, how: str, way: Way, cases: Sequence[Scored]) -> Baseline:
    found = _tried(way, cases)
    return Baseline(
        name,
        how,
        (
            _subsystem_first(found),
            share("effect first", [j.effect_first for case, j in found if case.demanded]),
            share("exact set", [j.exact for _, j in found]),
            share("confident wrong name", [j.wrong_name for _, j in found]),
            share("effect where there is none", [j.false_effect for _, j in found]),
            share("outside recognised", [j.recognised for _, j in found]),
        ),
    )
