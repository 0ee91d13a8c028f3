# SPDX-License-Identifier: MIT
"""Standing of each candidate beside the named set, with the reason; it only reads the selection."""

from __future__ import annotations

import math

from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.effect_selection import (
    Selection,
    edges_can_replace_force,
    insignificance,
    is_significant,
    objection,
    removed_share,
)
from ehsid.harness.gap.inference.likelihood_gain import likelihood_gain
from ehsid.harness.gap.inference.search import SearchResult
from ehsid.harness.gap.inference.sizes import matters
from ehsid.harness.gap.inference.words import in_words
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.schema import Standing
from ehsid.harness.gap.thresholds import DECIDED_TOGETHER


def standing(
    case: Case, search_result: SearchResult, selection: Selection, candidate: FittedCandidate
) -> Standing:
    """Returns the standing of a candidate and the condition of the selection that decided it.

    Parameters
    ----------
    case, search_result
        rig and records, and all candidates that were fitted.
    selection
        the selected set and its equivalents.
    candidate
        any candidate of the search.
    """
    best, calibrated = selection.best, search_result.calibrated
    if candidate is best:
        return Standing("named" if best.effects else "sufficient", "")
    if any(candidate is other for other in search_result.screened):
        return Standing("screened", "others gained more by a short fit")
    gain = likelihood_gain(case, best, candidate)
    if any(candidate is other for other in selection.equivalent):
        return Standing("equivalent", insignificance(gain) or "")
    if not candidate.effects:
        return Standing("worse", _how_much_worse(gain.relative))
    small = [
        effect for effect in candidate.effects if not matters(effect, candidate.values, case.rig)
    ]
    if small:
        return Standing("too_small", f"{in_words(small)} of this size is part of every servo")
    if edges_can_replace_force(case, candidate):
        return Standing(
            "too_small",
            "unequal metering edges of the valve can explain a load force of this size; measured "
            "chamber pressures would separate them",
        )
    if is_significant(gain):
        return Standing("worse", _how_much_worse(gain.relative))
    # A smaller or equal set is compared with the calibrated rig, a larger one with the named set.
    extends = len(candidate.effects) > len(best.effects) or candidate.x.size > best.x.size
    against = objection(case, candidate, best if extends else calibrated, calibrated)
    if against is not None and (extends or not best.effects):
        return Standing("not_needed", against)
    share = removed_share(case, candidate, calibrated)
    if share < DECIDED_TOGETHER:
        return Standing(
            "not_needed",
            f"it removes {100.0 * share:.0f} % of the errors above the noise floor, and less than "
            f"{100.0 * DECIDED_TOGETHER:.0f} % is not given a name",
        )
    return Standing("not_needed", against or insignificance(gain) or "")


def _how_much_worse(relative: float) -> str:
    ratio = math.exp(min(relative, 50.0))
    if ratio < 2.0:
        return f"its errors on held-out data are {100.0 * (ratio - 1.0):.2g} % larger"
    return f"its errors on held-out data are {ratio:.3g} times as large"
