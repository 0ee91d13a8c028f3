# SPDX-License-Identifier: MIT
"""Verdict of the diagnosis in words, with the reasons."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ..deciding import LEAST_GAIN, NEAR_FLOOR, NEAR_GAP, TOLD
from ..model.case import Case
from ..schema import Calibrated, CannotJudge, Estimate, HowFar, Verdict
from ..search.candidates import FittedCandidate
from ..search.intervals import AtBound, values_at_bounds
from ..search.search import SearchResult
from .effect_selection import Selection, chance, in_words, percent
from .results import caveats

# Errors, ln over what is tolerated, up to which commands that nobody logged cause nearly all of
# them: those that stay are 1.3 times what is tolerated on the average.
BY_COMMANDS = 0.5


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
    calibration: Mapping[str, Calibrated],
    hardly_shown: Sequence[CannotJudge],
    step: Estimate | None = None,
    missing: str = "",
    changing: str = "",
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
    hardly_shown
        selected effects of which the records show little, with the reason.
    step
        step of the position sensor, m, where it is coarse; else None.
    missing
        laws of a cause outside of the catalogue, in words; empty where none is known.
    changing
        what changes with the time, in words, where that speaks for such a cause and no law is
        known.
    """
    best, answer = selection.best, selection.answer
    reasons = [_gaps(best, reduction, missing), *caveats(case, search_result, selection, reduction)]
    reasons += [
        f"The records show little of {in_words([effect.id])}: {effect.why}."
        for effect in hardly_shown
    ]
    step_sentence = ""
    if step is not None:
        step_sentence = f" The position comes in steps of {step.value:.3g} m."
        reasons.append(
            "Steps of a sensor belong to the noise floor: no simulator can make them smaller."
        )

    stays = what_stays(case, selection, reduction)

    def decision(verdict: Verdict, *sentences: str) -> Decision:
        sentence = " ".join(filter(None, sentences))
        return Decision(verdict, f"{sentence}{step_sentence}", tuple(reasons))

    match answer.kind:
        case "outside":
            reasons.append(_why_outside(selection, missing, changing))
            return decision("outside_catalogue", _outside_sentence(best, missing), changing)
        case "ambiguous":
            first, *others = (
                f"{in_words(each.effects)} ({chance(selection.probability(each))})"
                for each in (best, *selection.equivalent)
            )
            reasons.append(f"The records cannot tell these candidates apart; {_next(case)}.")
            return decision(
                "ambiguous",
                f"The gap is due to {first}, or to {'; or '.join(others)}.",
                stays,
            )
        case "effects":
            share = reduction.of_explainable.value if reduction.of_explainable else 0.0
            pronoun = "it" if len(best.effects) == 1 else "them"
            if selection.rivals:
                reasons.append(
                    "The records do not tell whether what is named is the whole cause; "
                    f"{_next(case)}{'' if case.pressures else ', and measure both pressures'}."
                )
            return decision(
                "effects",
                f"The gap is due to {in_words(best.effects)}: adding {pronoun} removes "
                f"{100.0 * share:.0f} % of the gap above the noise floor.",
                stays,
            )
    by_values = selection.posterior.healthy.price.differ
    moved = [name for name, value in calibration.items() if value.moved]
    noise = largest_noise(reduction.calibrated, reduction.noise_floor)
    agrees = agrees_as_configured(reduction.nominal, noise)
    verdict: Verdict = "no_gap"
    differ = bool(moved) and by_values >= 0.5
    if differ or (not agrees and is_gained(reduction.from_nominal.low)):
        verdict = "parameters"
        sentence = _parameters_sentence(
            calibration, moved, values_at_bounds(case, best), reduction, stays
        )
        if not differ:
            reasons.append(
                "Values within the uncertainty that the rig file states do nearly as well."
                if by_values < 0.5
                else "No single value differs from the rig file by more than its uncertainty."
            )
    elif agrees:
        is_near = reduction.nominal <= NEAR_FLOOR * noise
        sentence = f"The simulator {'agrees' if is_near else 'nearly agrees'} with the machine"
        sentence += ", except for the sensor." if step is not None else "."
        if not is_near:
            sentence += (
                f" Its gap of {percent(reduction.nominal)} is small, and fitted values leave "
                f"{percent(reduction.calibrated)}."
            )
    else:
        sentence = (
            "Neither other values of the rig nor any effect of the catalogue make the gap of "
            f"{percent(reduction.nominal)} clearly smaller."
        )
    return decision("effects" if step is not None else verdict, sentence, stays)


def _next(case: Case) -> str:
    """What tells more: no experiment is designed on a simulator of the user."""
    if case.engine is None:
        return "see the next experiment"
    return "take a record with other motions"


def largest_noise(calibrated: float, floor: tuple[float, float]) -> float:
    """The upper end of the noise floor, but no more than what fitted values leave.

    Where no rest shows the noise, that end is a bound only, and may be as large as the motion.
    """
    return min(floor[1], max(floor[0], calibrated))


def agrees_as_configured(nominal: float, floor: float) -> bool:
    """Whether a gap as configured is near the noise floor, or small.

    floor: see `largest_noise`.
    """
    return nominal <= max(NEAR_FLOOR * floor, NEAR_GAP)


def is_gained(share: float) -> bool:
    """Whether the lower end of a shrinkage from nominal is a clear one."""
    return share >= LEAST_GAIN


def what_stays(case: Case, selection: Selection, reduction: HowFar) -> str:
    """Says which gap stays clearly above the noise floor, and of what its cause is not sure."""
    low, high = reduction.noise_floor
    stays = min(reduction.augmented, reduction.nominal)
    sentences = []
    if stays > NEAR_FLOOR * high:
        sentences.append(
            f"A gap of {percent(stays)} stays above the noise floor of {percent(low)} to "
            f"{percent(high)}."
        )
        best = selection.hypothesis(selection.best)
        if case.commands_are_missing and best is not None and best.left < BY_COMMANDS:
            sentences.append("Commands that the log does not have can cause most of it.")
    if selection.is_open:
        sentences.append(f"The cause is open; the most probable answers are {_answers(selection)}.")
    elif len(sentences) == 1 and selection.answer.kind != "ambiguous":
        sentences.append("No further effect of the catalogue explains it.")
    return " ".join(sentences)


def _answers(selection: Selection) -> str:
    """The answers that are probable enough to be told, most probable first."""
    posterior = selection.posterior
    answers = [("a cause outside of the catalogue", posterior.outside)]
    for families, share in posterior.by_families():
        effects = posterior.first_of(families).effects
        if effects == selection.best.effects and effects:
            answers.append((f"{in_words(effects)} alone", share))
        else:
            answers.append((in_words(effects) if effects else "no missing effect", share))
    answers.sort(key=lambda answer: -answer[1])
    told = [f"{words} ({chance(share)})" for words, share in answers if share >= TOLD]
    return _and(told or [f"{answers[0][0]} ({chance(answers[0][1])})"])


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


def _why_outside(selection: Selection, missing: str, changing: str) -> str:
    if missing:
        return (
            "A term without a name explains these records clearly better than the values of the "
            "rig and the effects of the catalogue do: a cause outside of it has a probability of "
            f"{chance(selection.posterior.outside)}."
        )
    if changing:
        return (
            "Part of what stays changes with the time alone, in the held-out data, too: a cause "
            "outside of the catalogue has a probability of "
            f"{chance(selection.posterior.outside)}."
        )
    return (
        "Whatever effect of the catalogue is added, larger errors stay than those of machines "
        "whose cause is in the catalogue: a cause outside of it has a probability of "
        f"{chance(selection.posterior.outside)}."
    )


def _parameters_sentence(
    calibration: Mapping[str, Calibrated],
    moved: Sequence[str],
    at_bounds: Sequence[AtBound],
    reduction: HowFar,
    stays: str,
) -> str:
    """Says what the values explain, and which differ; first which of them are not to trust.

    stays: what `what_stays` says.
    """
    from_to = f"from {percent(reduction.nominal)} to {percent(reduction.calibrated)}"
    if not moved:
        return (
            "Values within their uncertainty, and what no data sheet gives, take the gap "
            f"{from_to}."
        )
    differing = ", ".join(
        f"{name} {calibration[name].found.value:.4g} (file {calibration[name].rig:.4g})"
        for name in moved[:4]
    )
    does = f"take the gap {from_to}"
    if reduction.calibrated >= reduction.nominal:
        does = f"fit the records better, but the gap on held-out data goes {from_to}"
    if at_bounds:
        values = "this value" if len(at_bounds) == 1 else "these values"
        return (
            f"Other values of the rig {does}, but {_and(one.told for one in at_bounds)} of "
            "what the rig file allows, so the true cause may be something else: check "
            f"{values} on the machine. Values that differ from the rig file: {differing}."
        )
    if stays:
        return f"Other values of the rig {does}: {differing}."
    return f"No effect is missing, but values differ from the rig file: {differing}."


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
