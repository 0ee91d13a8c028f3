# SPDX-License-Identifier: MIT
"""Standing of each candidate beside the named set, with the reason; it only reads the selection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ...catalogue.keys import ParameterKey
from ...catalogue.parameters import effects
from ...catalogue.value_names import VALUE_NAMES
from ...rigs import Rig
from ..model.case import Case
from ..search.candidates import FittedCandidate
from ..search.likelihood_gain import likelihood_gain
from ..search.search import SearchResult
from ..search.sizes import matters, simpler_part, too_large
from .effect_selection import Selection
from .words import chance, in_words

StandingKind = Literal[
    "named", "equivalent", "sufficient", "not_needed", "too_small", "worse", "screened"
]


@dataclass(frozen=True)
class Standing:
    """What the decision made of a candidate, as `schema.Candidate` has it.

    `why` is the condition that decided, as a clause; empty where `kind` says all.
    """

    kind: StandingKind
    why: str


def standing(
    case: Case, search_result: SearchResult, selection: Selection, candidate: FittedCandidate
) -> Standing:
    """Returns the standing of a candidate and what decided it.

    Parameters
    ----------
    case, search_result
        rig and records, and all candidates that were fitted.
    selection
        the selected set and its equivalents.
    candidate
        any candidate of the search.
    """
    best = selection.best
    hypothesis = selection.hypothesis(candidate)
    if candidate is best:
        return Standing("named" if best.effects else "sufficient", "")
    if any(candidate is other for other in search_result.screened):
        return Standing("screened", "others gained more by a short fit")
    if hypothesis is None:
        return Standing("too_small", _why_too_small(case, candidate))
    why = f"its probability is {chance(hypothesis.probability)}"
    if any(candidate is other for other in selection.equivalent):
        return Standing("equivalent", why)
    relative = likelihood_gain(case, best, candidate).relative
    if relative > 0.0:
        return Standing("worse", f"{_how_much_worse(relative)}; {why}")
    return Standing(
        "not_needed",
        f"{why}: errors that are {100.0 * -math.expm1(relative):.2g} % smaller do not outweigh "
        "what each effect costs",
    )


def _why_too_small(case: Case, candidate: FittedCandidate) -> str:
    reasons = [
        _why_no_name(effect, candidate.values, case.rig)
        for effect in candidate.effects
        if not matters(effect, candidate.values, case.rig)
    ]
    if reasons:
        return "; ".join(reasons)
    return (
        "unequal metering edges of the valve can explain a load force of this size; measured "
        "chamber pressures would separate them"
    )


def _why_no_name(effect: str, values: Mapping[str, float], rig: Rig) -> str:
    """Says what of an effect is too small, or too large, to be named."""
    name, simple = in_words([effect]), simpler_part(effect, values, rig)
    if simple is None:
        return f"{name} of this size is part of every servo"
    if too_large(effect, values, rig):
        return (
            f"no servo has {name} of these sizes ({_sizes(effect, values)}), and "
            f"{in_words([simple])}, which it contains, is judged by itself; the limits are: "
            f"{effects()[effect].least_size}"
        )
    return f"{name} differs from {in_words([simple])} by no more than in every servo"


def _sizes(effect: str, values: Mapping[str, float]) -> str:
    """Returns the sizes of an effect in words, with units."""
    told = []
    for parameter in effects()[effect].parameters:
        key = ParameterKey.of_effect(effect, parameter.name)
        name = VALUE_NAMES.get(key, parameter.name.removesuffix("_m_s").replace("_", " "))
        name = name.replace("stribeck", "Stribeck")
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        told.append(f"{name} {values[key]:.5g}{unit}")
    return ", ".join(told)


def _how_much_worse(relative: float) -> str:
    ratio = math.exp(min(relative, 50.0))
    if ratio < 2.0:
        return f"its errors on held-out data are {100.0 * (ratio - 1.0):.2g} % larger"
    return f"its errors on held-out data are {ratio:.3g} times as large"
