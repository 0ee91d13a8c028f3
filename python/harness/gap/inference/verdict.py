# SPDX-License-Identifier: MIT
"""Verdict of the diagnosis from the figures of the fits, with the reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.gap.inference.advantage import above_floor, advantage
from ehsid.harness.gap.inference.choice import Choice, decided, one_family, rms
from ehsid.harness.gap.inference.rivals import Rival
from ehsid.harness.gap.inference.search import Found
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
class Ruling:
    """Verdict, the same in one plain sentence, and the reasons for it."""

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]


def rule(
    case: Case,
    found: Found,
    choice: Choice,
    far: HowFar,
    calibration: Mapping[str, CalibratedValue],
    beyond: Sequence[CannotJudge],
    untouched: Rival | None = None,
    step: Estimate | None = None,
) -> Ruling:
    """Decides the verdict on data that can carry a diagnosis.

    Parameters
    ----------
    case, found, choice
        rig and records, fitted candidates, and the chosen set of effects.
    far
        figures of the gap on the held-out records.
    calibration
        calibrated values, and whether they have moved, by full name.
    beyond
        chosen effects whose size no record reached, with the reason.
    untouched
        the fit with the rig's own values as in the rig file; None where an effect was found.
    step
        step of the position sensor, m, where it is coarse; else None.
    """
    best = choice.best
    above = above_floor(case, best)
    floor = far.noise_floor[1]
    room = far.calibrated - floor
    left = (far.augmented - floor) / room if best.effects and room > 0.0 else 1.0
    reasons = [
        f"On held-out data the gap is {_percent(far.nominal)} with the simulator as configured, "
        f"{_percent(far.calibrated)} with the values of the rig fitted"
        + (f", {_percent(far.augmented)} with {named(best.effects)} added" if best.effects else "")
        + f"; the noise floor is {_percent(far.noise_floor[0])} to {_percent(floor)}."
    ]
    bearable = LEFT_NRMSE_SWINGING if case.all_states else LEFT_NRMSE
    unexplained = above > LEFT_ABOVE and far.augmented > bearable and left > LEFT_SHARE
    if unexplained:
        reasons.append(
            f"Whatever effect of the catalogue is added, {100.0 * left:.0f} % of the gap that "
            f"fitting left stays above the noise floor: {math.exp(above):.1f} times the noise."
        )
    for one in beyond:
        reasons.append(f"{one.id}: {one.why}.")
    coarse = ""
    if step is not None:
        coarse = f" The position comes in steps of {step.value:.3g} m."
        reasons.append(
            "Steps of a sensor belong to the noise floor: no simulator can make them smaller."
        )
    if unexplained and best.effects:
        return Ruling(
            "outside_catalogue",
            f"Part of the gap is due to {named(best.effects)}; no effect of the catalogue "
            f"explains the rest.{coarse}",
            tuple(reasons),
        )
    if unexplained:
        return Ruling(
            "outside_catalogue",
            "Neither other values of the rig nor any effect of the catalogue explain the gap.",
            tuple(reasons),
        )
    if best.effects:
        families = {one_family(one.effects) for one in (best, *choice.equals)}
        if len(families) > 1:
            others = "; or ".join(named(one.effects) for one in choice.equals[:3])
            reasons.append(
                "The records cannot tell these candidates apart; see the next experiment."
            )
            return Ruling(
                "ambiguous",
                f"The gap is due to {named(best.effects)}, or to {others}.{coarse}",
                tuple(reasons),
            )
        share = far.of_explainable.value if far.of_explainable else 0.0
        these = "it" if len(best.effects) == 1 else "them"
        return Ruling(
            "effects",
            f"The gap is due to {named(best.effects)}: adding {these} removes "
            f"{100.0 * share:.0f} % of the gap above the noise floor.{coarse}",
            tuple(reasons),
        )
    if step is not None:
        return Ruling(
            "effects",
            f"The simulator agrees with the machine, except for the sensor.{coarse}",
            tuple(reasons),
        )
    moved = [name for name, value in calibration.items() if value.moved]
    gain = advantage(case, found.calibrated, found.nominal)
    by_values = 0.0
    if untouched is not None:
        scale = case.variation()
        less = float(np.sum((rms(untouched) - rms(found.calibrated)) / scale))
        by_values = less / max(float(np.sum(rms(found.nominal) / scale)), 1e-300)
    if moved and decided(gain) and by_values >= VALUES_SHARE:
        return Ruling(
            "parameters",
            "No effect is missing, but values differ from the rig file: "
            + ", ".join(
                f"{name} {calibration[name].found.value:.4g} (file {calibration[name].rig:.4g})"
                for name in moved[:4]
            )
            + ".",
            tuple(reasons),
        )
    if decided(gain):
        reasons.append(
            "Only values that no data sheet gives (edges, seals, oil, spool) improve the fit; "
            "those of the rig file do not have to change."
        )
    return Ruling("no_gap", "The simulator agrees with the machine.", tuple(reasons))


def named(effects: Sequence[str]) -> str:
    """Returns the ids of effects as a list in words."""
    words = [effect.replace("_", " ") for effect in effects]
    words = [word.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck") for word in words]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def _percent(gap: float) -> str:
    return f"{100.0 * gap:.2g} %"
