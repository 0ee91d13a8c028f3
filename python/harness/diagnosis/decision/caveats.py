# SPDX-License-Identifier: MIT
"""Sentences on what a reader of the verdict would otherwise take for a contradiction."""

from __future__ import annotations

from ..deciding import FIT_TOGETHER
from ..model.case import Case
from ..schema import HowFar
from ..search.bounds import values_at_bounds
from ..search.candidates import FittedCandidate
from ..search.gap_reduction import explained_share
from ..search.search import SearchResult
from .effect_selection import Selection
from .standing import standing
from .words import chance, in_words, percent

# The fitted values are called worse than those of the rig file where the gap on held-out data is
# larger by a twentieth: the same tolerance by which sets of effects are told apart.
WORSE_CALIBRATED = 1.05
# A set that is not named is spoken of where it would remove a quarter of the gap.
MUCH_REMOVED = 0.25


def caveats(
    case: Case, search_result: SearchResult, selection: Selection, reduction: HowFar
) -> tuple[str, ...]:
    """Returns the sentences that apply, in the order in which a reader meets the matter."""
    return (
        *_worse_calibration(selection.best, reduction),
        *_cause_not_excluded(selection),
        *_unnamed_candidates(case, search_result, selection),
        *_values_at_bounds(case, selection.best),
    )


def _worse_calibration(best: FittedCandidate, reduction: HowFar) -> list[str]:
    """Says where the fitted values are worse than the rig file on data that were not fitted."""
    nominal, calibrated = reduction.nominal, reduction.calibrated
    if calibrated <= max(WORSE_CALIBRATED * nominal, reduction.noise_floor[1]):
        return []
    why = "the cause of the gap differs between these data, or the simulator lacks it"
    if best.effects:
        why = (
            f"without {in_words(best.effects)} the fit makes the values of the rig stand in for "
            f"{'it' if len(best.effects) == 1 else 'them'}, which holds for the fitted data only"
        )
    return [
        "The fitted values of the rig are worse than those of the rig file on held-out data: the "
        f"gap is {percent(calibrated)} in place of {percent(nominal)}. Values are fitted to some "
        f"data and judged by others; {why}."
    ]


def _cause_not_excluded(selection: Selection) -> list[str]:
    """Says where nothing is named although a cause outside of the catalogue is not improbable."""
    outside = selection.posterior.outside
    if selection.answer.kind != "healthy" or outside < FIT_TOGETHER:
        return []
    return [
        f"A cause outside of the catalogue is not excluded: its probability is {chance(outside)}. "
        "To blame a sound machine would cost more than to look further, so nothing is blamed."
    ]


def _unnamed_candidates(case: Case, search_result: SearchResult, selection: Selection) -> list[str]:
    """Says why the first candidate, or one that explains much while nothing is named, is not named.

    Equivalent sets are listed in the verdict itself.
    """
    best, calibrated = selection.best, search_result.calibrated
    fitted = search_result.fitted()
    first = fitted[0]
    in_set = any(first is candidate for candidate in (best, *selection.equivalent))
    sentences = []
    if first.effects and not in_set:
        why = standing(case, search_result, selection, first).why
        sentences.append(
            f"The set with the smallest errors on held-out data, {in_words(first.effects)}, is not "
            f"named: {why}."
        )
    if best.effects:
        return sentences
    for candidate in fitted:
        share = explained_share(calibrated.sums, candidate.sums, case.floors, best.sums)
        if candidate in (first, calibrated) or share is None or share < MUCH_REMOVED:
            continue
        why = standing(case, search_result, selection, candidate).why
        sentences.append(
            f"The set {in_words(candidate.effects)} would remove {100.0 * share:.0f} % of the gap "
            f"above the noise floor, but is not named: {why}."
        )
        break
    return sentences


def _values_at_bounds(case: Case, best: FittedCandidate) -> list[str]:
    """Says which fitted values of the rig or of an effect ended at an end of their range."""
    return [
        f"{one.told} of the range of this effect: a further cause may act in the same way."
        if one.key.effect in best.effects
        else f"{one.told} of what the uncertainty in the rig file allows: either give it a larger "
        "one under [uncertainty], or this value stands in for a cause that is not modelled."
        for one in values_at_bounds(case, best)
    ]
