# SPDX-License-Identifier: MIT
"""Verdict of the diagnosis from the results of the fits, with the reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.caveats import caveats
from ehsid.harness.gap.inference.effect_selection import (
    Selection,
    effect_families,
    held_out_rms,
    is_significant,
)
from ehsid.harness.gap.inference.likelihood_gain import above_floor, likelihood_gain
from ehsid.harness.gap.inference.search import SearchResult
from ehsid.harness.gap.inference.words import in_words, percent
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.schema import CalibratedValue, CannotJudge, Estimate, HowFar, Verdict
from ehsid.harness.gap.thresholds import (
    LEFT_ABOVE,
    LEFT_NRMSE,
    LEFT_NRMSE_SWINGING,
    LEFT_SHARE,
    VALUES_SHARE,
)


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
) -> Decision:
    """Decides the verdict on data that can carry a diagnosis.

    Parameters
    ----------
    case, search_result, selection
        rig and records, fitted candidates, and the selected set of effects.
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
    """
    best = selection.best
    excess = above_floor(case, best)
    floor = reduction.noise_floor[1]
    explainable = reduction.calibrated - floor
    remaining_share = (
        (reduction.augmented - floor) / explainable if best.effects and explainable > 0.0 else 1.0
    )
    reasons = [
        f"On held-out data the gap is {percent(reduction.nominal)} with the simulator as "
        f"configured, {percent(reduction.calibrated)} with the values of the rig fitted"
        + (
            f", {percent(reduction.augmented)} with {in_words(best.effects)} added"
            if best.effects
            else ""
        )
        + f"; the noise floor is {percent(reduction.noise_floor[0])} to {percent(floor)}."
    ]
    tolerable = LEFT_NRMSE_SWINGING if case.all_states else LEFT_NRMSE
    unexplained = (
        excess > LEFT_ABOVE and reduction.augmented > tolerable and remaining_share > LEFT_SHARE
    )
    if unexplained:
        reasons.append(
            f"Whatever effect of the catalogue is added, {100.0 * remaining_share:.0f} % of the "
            "gap that fitting left stays above the noise floor: "
            f"{math.exp(excess):.1f} times the noise."
        )
    reasons += caveats(case, search_result, selection, reduction)
    for effect in extrapolated:
        reasons.append(f"{effect.id}: {effect.why}.")
    step_sentence = ""
    if step is not None:
        step_sentence = f" The position comes in steps of {step.value:.3g} m."
        reasons.append(
            "Steps of a sensor belong to the noise floor: no simulator can make them smaller."
        )
    if unexplained and best.effects:
        return Decision(
            "outside_catalogue",
            f"Part of the gap is due to {in_words(best.effects)}; no effect of the catalogue "
            f"explains the rest.{step_sentence}",
            tuple(reasons),
        )
    if unexplained:
        return Decision(
            "outside_catalogue",
            "Neither other values of the rig nor any effect of the catalogue explain the gap.",
            tuple(reasons),
        )
    if best.effects:
        families = {
            effect_families(candidate.effects) for candidate in (best, *selection.equivalent)
        }
        if len(families) > 1:
            others = "; or ".join(
                in_words(candidate.effects) for candidate in selection.equivalent[:3]
            )
            reasons.append(
                "The records cannot tell these candidates apart; see the next experiment."
            )
            return Decision(
                "ambiguous",
                f"The gap is due to {in_words(best.effects)}, or to {others}.{step_sentence}",
                tuple(reasons),
            )
        share = reduction.of_explainable.value if reduction.of_explainable else 0.0
        pronoun = "it" if len(best.effects) == 1 else "them"
        return Decision(
            "effects",
            f"The gap is due to {in_words(best.effects)}: adding {pronoun} removes "
            f"{100.0 * share:.0f} % of the gap above the noise floor.{step_sentence}",
            tuple(reasons),
        )
    if step is not None:
        return Decision(
            "effects",
            f"The simulator agrees with the machine, except for the sensor.{step_sentence}",
            tuple(reasons),
        )
    moved = [name for name, value in calibration.items() if value.moved]
    gain = likelihood_gain(case, search_result.calibrated, search_result.nominal)
    by_values = 0.0
    if nuisance_fit is not None:
        scale = case.variation()
        gain_by_values = float(
            np.sum((held_out_rms(nuisance_fit) - held_out_rms(search_result.calibrated)) / scale)
        )
        by_values = gain_by_values / max(
            float(np.sum(held_out_rms(search_result.nominal) / scale)), 1e-300
        )
    if moved and is_significant(gain) and by_values >= VALUES_SHARE:
        return Decision(
            "parameters",
            "No effect is missing, but values differ from the rig file: "
            + ", ".join(
                f"{name} {calibration[name].found.value:.4g} (file {calibration[name].rig:.4g})"
                for name in moved[:4]
            )
            + ".",
            tuple(reasons),
        )
    if is_significant(gain):
        reasons.append(
            "Only values that no data sheet gives (edges, seals, oil, spool) improve the fit; "
            "those of the rig file do not have to change."
        )
    return Decision("no_gap", "The simulator agrees with the machine.", tuple(reasons))
