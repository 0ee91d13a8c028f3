# SPDX-License-Identifier: MIT
"""What no diagnosis may contain: statements that contradict each other."""

from __future__ import annotations

import itertools
import math

from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.inference.effect_selection import effect_families
from ehsid.harness.gap.inference.quantised import QUANTISATION
from ehsid.harness.gap.inference.words import in_words
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.gap.thresholds import DECIDED_TOGETHER, WORSE_CALIBRATED

IN_THE_SET = ("named", "sufficient", "equivalent")


def contradictions(diagnosis: Diagnosis) -> list[str]:
    """Returns each statement of a diagnosis that another one contradicts."""
    if diagnosis.how_far is None:
        return [] if diagnosis.verdict == "insufficient_data" and diagnosis.reasons else ["figures"]
    reasons = " ".join(diagnosis.reasons)
    named = tuple(effect.id for effect in diagnosis.effects if effect.id != QUANTISATION)
    checks = {
        "exactly one set is named or sufficient": _one_set(diagnosis, named),
        "marked sets are those with a standing in the set": all(
            each.in_confidence_set == (each.standing.kind in IN_THE_SET)
            for each in diagnosis.candidates
        ),
        "the ambiguity set holds the marked sets": {
            tuple(name for name in names if name != QUANTISATION)
            for names in diagnosis.ambiguity_set
        }
        - {()}
        == {each.effects for each in diagnosis.candidates if each.in_confidence_set} - {()},
        "candidates are in the order of their scores": _ordered(diagnosis),
        "each set that is not in the set has a reason": all(
            each.standing.why or each.standing.kind in IN_THE_SET for each in diagnosis.candidates
        ),
        "a first candidate that is not in the set is explained": (
            diagnosis.candidates[0].in_confidence_set or "smallest errors" in reasons
        ),
        "a set that explains much is named or explained": named != ()
        or all(
            each.held_out_shrinkage < DECIDED_TOGETHER or in_words(each.effects) in reasons
            for each in diagnosis.candidates[:2]
            if each.effects
        ),
        "the verdict is ambiguous where families differ": (diagnosis.verdict == "ambiguous")
        == (
            diagnosis.verdict != "outside_catalogue"
            and len({effect_families(names) for names in diagnosis.ambiguity_set}) > 1
        ),
        "the share that is removed is that of the named set": _same_share(diagnosis, named),
        "a worse calibration is said": ("are worse than those of the rig file" in reasons)
        == (
            diagnosis.how_far.calibrated
            > max(WORSE_CALIBRATED * diagnosis.how_far.nominal, diagnosis.how_far.noise_floor[1])
        ),
        "moved values are said where the verdict rests on them": diagnosis.verdict != "parameters"
        or any(value.moved for value in diagnosis.calibration.values()),
        "values that moved are no nuisances": not any(
            value.moved and ParameterKey(name).is_nuisance
            for name, value in diagnosis.calibration.items()
        ),
    }
    return [statement for statement, holds in checks.items() if not holds]


def _one_set(diagnosis: Diagnosis, named: tuple[str, ...]) -> bool:
    chosen = [
        each.effects
        for each in diagnosis.candidates
        if each.standing.kind in ("named", "sufficient")
    ]
    return chosen == [named]


def _ordered(diagnosis: Diagnosis) -> bool:
    scores = [each.score for each in diagnosis.candidates]
    return scores[0] == 0.0 and all(
        # The held-out costs decide the order; scores are rounded differently.
        later >= earlier - 1e-6 * max(1.0, abs(earlier))
        for earlier, later in itertools.pairwise(scores)
    )


def _same_share(diagnosis: Diagnosis, named: tuple[str, ...]) -> bool:
    assert diagnosis.how_far is not None
    if not named or diagnosis.how_far.of_explainable is None:
        return True
    (share,) = (
        each.held_out_shrinkage for each in diagnosis.candidates if each.standing.kind == "named"
    )
    stated = diagnosis.how_far.of_explainable.value
    return math.isclose(share, stated, rel_tol=1e-6, abs_tol=1e-6) and stated <= 1.0 + 1e-9
