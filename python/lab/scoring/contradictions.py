# SPDX-License-Identifier: MIT
"""What no diagnosis may contain: statements that contradict each other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from ehsid.harness.catalogue.families import effect_families
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis.deciding import NEAR_FLOOR, TOLD
from ehsid.harness.diagnosis.decision.effect_selection import OPEN, in_words
from ehsid.harness.diagnosis.decision.results import MUCH_REMOVED, WORSE_CALIBRATED
from ehsid.harness.diagnosis.decision.verdict import agrees_as_configured, is_gained, largest_noise
from ehsid.harness.diagnosis.schema import Candidate, DiagnosisFile
from ehsid.harness.diagnosis.search.maps import QUANTISATION

CHOSEN = ("named", "sufficient", "not_sufficient")
IN_THE_SET = (*CHOSEN, "equivalent")


def contradictions(file: DiagnosisFile) -> tuple[str, ...]:
    """Returns the rules that the statements of a diagnosis break; none where it is consistent.

    A file whose candidates have no standing was written by another program, which decides in
    another way: only rules on what this program decides apply, so none is broken.
    """
    if file.verdict == "insufficient_data":
        return () if file.reasons else ("data that cannot carry a diagnosis have a reason",)
    candidates = file.which.candidates
    if not candidates or any(each.standing is None for each in candidates):
        return ()
    reasons = " ".join(file.reasons)
    which = file.which
    named = frozenset(effect.id for effect in which.effects) - {QUANTISATION}
    sets = {frozenset(names) - {QUANTISATION} for names in which.ambiguity_set}
    calibrated, nominal = file.how_far.calibrated, file.how_far.nominal
    rules = {
        "exactly one set is named or sufficient, and it is the one of the verdict": [
            frozenset(each.effects) for each in candidates if each.standing in CHOSEN
        ]
        == [named],
        "no effect is called sufficient only where the cause is in the catalogue": all(
            (each.standing == "not_sufficient") == (file.verdict == "outside_catalogue")
            for each in candidates
            if each.standing in CHOSEN and not each.effects
        ),
        "no effect is named that is less probable than one in ten": all(
            effect.probability >= TOLD for effect in which.effects
        ),
        "sets are marked exactly if their standing is in the set": all(
            each.in_confidence_set == (each.standing in IN_THE_SET) for each in candidates
        ),
        "the ambiguity set holds the marked sets": sets - {frozenset()}
        == {frozenset(each.effects) for each in candidates if each.in_confidence_set}
        - {frozenset()},
        "candidates are in the order of their scores": _ordered(candidates),
        "each set that is not in the set has a reason": all(
            each.why or each.standing in IN_THE_SET for each in candidates
        ),
        "a first candidate that is not in the set is explained": (
            candidates[0].in_confidence_set or "smallest errors" in reasons
        ),
        "a set that explains much is named or explained": bool(named)
        or all(
            each.held_out_shrinkage < MUCH_REMOVED or in_words(each.effects) in reasons
            for each in candidates[:2]
            if each.effects
        ),
        "the verdict is ambiguous where families differ": (file.verdict == "ambiguous")
        == (
            file.verdict != "outside_catalogue"
            and len({effect_families(names) for names in which.ambiguity_set}) > 1
        ),
        "the share that is removed is that of the named set": _same_share(file, named),
        "a worse calibration is said": ("are worse than those of the rig file" in reasons)
        == (calibrated > max(WORSE_CALIBRATED * nominal, file.how_far.noise_floor[1])),
        "values that moved are said where the verdict rests on them": file.verdict != "parameters"
        or any(value.moved for value in file.calibration.values())
        or not _agrees(file),
        "no gap is told near the floor only, or where nothing makes it smaller": file.verdict
        != "no_gap"
        or _agrees(file)
        or not is_gained(file.how_far.shrinkage_from_nominal.ci90[0]),
        "a gap that stays above the floor is said": file.verdict == "outside_catalogue"
        or ("stays above the noise floor" in file.sentence) == _stays(file),
        "an open cause is said": file.verdict == "outside_catalogue"
        or ("The cause is open" in file.sentence) == _is_open(candidates),
        "no effect is called missing only where none is probable and no gap stays": (
            "No effect is missing" not in file.sentence
            or not (_is_open(candidates) or _stays(file))
        ),
        "a named effect could be judged": not (
            {name for names in sets for name in names} & {one.id for one in which.cannot_judge}
        ),
        "the part of the machine of each named effect has a share": bool(which.missing_law)
        or not file.where.subsystem
        or all(
            file.where.subsystem.get(effects()[name].subsystem, 0.0) > 0.0
            for names in (named, *sets)
            for name in names
        ),
        "an experiment is designed only where it tells something": which.next_experiment is None
        or file.verdict == "ambiguous"
        or _is_open(candidates),
        "values that moved are no nuisances": not any(
            value.moved and ParameterKey(name).is_nuisance
            for name, value in file.calibration.items()
        ),
    }
    return tuple(rule for rule, holds in rules.items() if not holds)


def _agrees(file: DiagnosisFile) -> bool:
    found = file.how_far
    noise = largest_noise(found.calibrated, found.noise_floor)
    return agrees_as_configured(found.nominal, noise)


def _stays(file: DiagnosisFile) -> bool:
    stays = min(file.how_far.nominal, file.how_far.augmented)
    return stays > NEAR_FLOOR * file.how_far.noise_floor[1]


def _is_open(candidates: Sequence[Candidate]) -> bool:
    """Whether the sets that were given are not probable enough, all laws of a family together."""
    given = {effect_families(each.effects) for each in candidates if each.in_confidence_set}
    return (
        sum(
            each.probability
            for each in candidates
            if each.probability is not None and effect_families(each.effects) in given
        )
        < 1.0 - OPEN
    )


def _ordered(candidates: Sequence[Candidate]) -> bool:
    scores = [each.score for each in candidates]
    return scores[0] == 0.0 and all(
        # The held-out costs decide the order; scores are rounded differently.
        later >= earlier - 1e-6 * max(1.0, abs(earlier))
        for earlier, later in itertools.pairwise(scores)
    )


def _same_share(file: DiagnosisFile, named: frozenset[str]) -> bool:
    stated = file.how_far.of_explainable
    # Missing laws remove more than the named set does.
    if not named or stated is None or file.which.missing_law:
        return True
    shares = [each.held_out_shrinkage for each in file.which.candidates if each.standing == "named"]
    return (
        len(shares) == 1
        and math.isclose(shares[0], stated.value, rel_tol=1e-6, abs_tol=1e-6)
        and stated.value <= 1.0 + 1e-9
    )
