# SPDX-License-Identifier: MIT
"""Verdict of the diagnosis in words, with the reasons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ehsid.harness.gap.deciding import VALUES
from ehsid.harness.gap.inference.bounds import AtBound, values_at_bounds
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.caveats import caveats
from ehsid.harness.gap.inference.effect_selection import Selection
from ehsid.harness.gap.inference.evidence import left
from ehsid.harness.gap.inference.search import SearchResult
from ehsid.harness.gap.inference.words import chance, in_words, percent
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.schema import CalibratedValue, CannotJudge, Estimate, HowFar, Verdict


@dataclass(frozen=True)
class Decision:
    """Verdict, the same in one plain sentence, and the reasons for it."""

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]


def decide(
    case: Case,
    search_result: SearchResult,
    selection: Selection,
    reduction: HowFar,
    calibration: Mapping[str, CalibratedValue],
    extrapolated: Sequence[CannotJudge],
    nuisance_fit: FittedCandidate | None = None,
    step: Estimate | None = None,
    missing: str = "",
) -> Decision:
    """Puts the answer of the selection into a verdict on data that can carry a diagnosis.

    Parameters
    ----------
    case, search_result, selection
        rig and records, fitted candidates, and the answer that loses least.
    reduction
        gaps on the held-out records, and by how much the effects reduce them.
    calibration
        calibrated values, and whether they have moved, by full name.
    extrapolated
        selected effects whose size no record reached, with the reason.
    nuisance_fit
        the fit of the nuisances alone, with the rig's own values as in the rig file; None where an
        effect was selected.
    step
        step of the position sensor, m, where it is coarse; else None.
    missing
        laws of a cause outside of the catalogue, in words; empty where none is known.
    """
    best, answer = selection.best, selection.answer
    reasons = [_gaps(best, reduction, missing), *caveats(case, search_result, selection, reduction)]
    reasons += [f"{effect.id}: {effect.why}." for effect in extrapolated]
    step_sentence = ""
    if step is not None:
        step_sentence = f" The position comes in steps of {step.value:.3g} m."
        reasons.append(
            "Steps of a sensor belong to the noise floor: no simulator can make them smaller."
        )

    def decision(verdict: Verdict, sentence: str) -> Decision:
        return Decision(verdict, f"{sentence}{step_sentence}", tuple(reasons))

    match answer.kind:
        case "outside":
            reasons.append(_what_is_left(selection, missing))
            return decision("outside_catalogue", _outside_sentence(best, missing))
        case "ambiguous":
            others = "; or ".join(in_words(each.effects) for each in selection.equivalent)
            reasons.append(
                "The records cannot tell these candidates apart; see the next experiment."
            )
            return decision(
                "ambiguous", f"The gap is due to {in_words(best.effects)}, or to {others}."
            )
        case "effects":
            share = reduction.of_explainable.value if reduction.of_explainable else 0.0
            pronoun = "it" if len(best.effects) == 1 else "them"
            return decision(
                "effects",
                f"The gap is due to {in_words(best.effects)}: adding {pronoun} removes "
                f"{100.0 * share:.0f} % of the gap above the noise floor.",
            )
    if step is not None:
        return decision("effects", "The simulator agrees with the machine, except for the sensor.")
    moved = [name for name, value in calibration.items() if value.moved]
    by_values = 0.0
    if nuisance_fit is not None:
        by_values = left(case, nuisance_fit) - left(case, search_result.calibrated)
    if moved and by_values >= VALUES:
        sentence = _parameters_sentence(calibration, moved, values_at_bounds(case, best))
        return decision("parameters", sentence)
    return decision("no_gap", "The simulator agrees with the machine.")


def _gaps(best: FittedCandidate, reduction: HowFar, missing: str) -> str:
    low, high = reduction.noise_floor
    added = [in_words(best.effects)] if best.effects else []
    if missing:
        added.append("what the simulator lacks")
    last = f", {percent(reduction.augmented)} with {' and '.join(added)} added" if added else ""
    return (
        f"On held-out data the gap is {percent(reduction.nominal)} with the simulator as "
        f"configured, {percent(reduction.calibrated)} with the values of the rig fitted{last}; "
        f"the noise floor is {percent(low)} to {percent(high)}."
    )


def _what_is_left(selection: Selection, missing: str) -> str:
    if missing:
        return (
            "A term without a name explains these records clearly better than the values of the "
            "rig and the effects of the catalogue do: a cause outside of it has a probability of "
            f"{chance(selection.posterior.outside)}."
        )
    return (
        "Whatever effect of the catalogue is added, larger errors stay than those of machines "
        "whose cause is in the catalogue: a cause outside of it has a probability of "
        f"{chance(selection.posterior.outside)}."
    )


def _parameters_sentence(
    calibration: Mapping[str, CalibratedValue], moved: Sequence[str], at_bounds: Sequence[AtBound]
) -> str:
    """Says which values differ, but first which of them are at an end: those are not to trust."""
    differing = ", ".join(
        f"{name} {calibration[name].found.value:.4g} (file {calibration[name].rig:.4g})"
        for name in moved[:4]
    )
    if not at_bounds:
        return f"No effect is missing, but values differ from the rig file: {differing}."
    values = "this value" if len(at_bounds) == 1 else "these values"
    return (
        f"Other values of the rig explain the gap, but {_and(one.told for one in at_bounds)} of "
        "what the rig file allows, so the true cause may be something else: check "
        f"{values} on the machine. Values that differ from the rig file: {differing}."
    )


def _and(parts: Iterable[str]) -> str:
    *others, last = parts
    return f"{', '.join(others)} and {last}" if others else last


def _outside_sentence(best: FittedCandidate, missing: str) -> str:
    sentence = "Neither other values of the rig nor any effect of the catalogue explain the gap."
    if best.effects:
        sentence = (
            f"Part of the gap is due to {in_words(best.effects)}; no effect of the catalogue "
            "explains the rest."
        )
    return f"{sentence} {missing}".strip()
