# SPDX-License-Identifier: MIT
"""The constants of the probabilities as one value, so that others can be put in their place."""

from __future__ import annotations

from dataclasses import dataclass

from ..deciding import (
    EFFECT,
    EVIDENCE,
    LAPSE,
    LEAST_LEFT,
    OUTSIDE,
    OUTSIDE_BESIDE,
    OUTSIDE_EXPLAINED,
    OUTSIDE_LEFT,
    OUTSIDE_POSITION,
    SMALL,
)


@dataclass(frozen=True)
class Constants:
    """Constants of the equations of `posterior`; `deciding` has the reasons.

    Attributes
    ----------
    evidence
        number of independent errors, > 0.
    least_left
        errors below which a simulator is as good as perfect, ln over what is tolerated, > 0.
    effect, small
        prior cost of a law, and further cost of an effect that is no larger than in every servo,
        nats.
    outside, outside_beside
        odds of a cause outside of the catalogue without and with an effect in the best set, nats.
    outside_left, outside_explained
        increase of these odds with the ln of the errors left, and with what the best set explains.
    outside_position
        increase of these odds where no pressure is measured, nats.
    lapse
        share of the probability that all answers have alike, between 0 and 1.
    """

    evidence: float
    least_left: float
    effect: float
    small: float
    outside: float
    outside_beside: float
    outside_left: float
    outside_explained: float
    outside_position: float
    lapse: float


IN_USE = Constants(
    evidence=EVIDENCE,
    least_left=LEAST_LEFT,
    effect=EFFECT,
    small=SMALL,
    outside=OUTSIDE,
    outside_beside=OUTSIDE_BESIDE,
    outside_left=OUTSIDE_LEFT,
    outside_explained=OUTSIDE_EXPLAINED,
    outside_position=OUTSIDE_POSITION,
    lapse=LAPSE,
)
