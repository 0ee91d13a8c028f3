# SPDX-License-Identifier: MIT
"""The constants of the probabilities as one value, so that others can be put in their place."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.gap import deciding


@dataclass(frozen=True)
class Constants:
    """Constants of `posterior.score` and `posterior.outside_score`; `gap.deciding` has the reasons.

    Attributes
    ----------
    evidence
        number of independent errors, > 0.
    least_left
        errors of a simulator that lacks nothing, ln over what is tolerated, > 0.
    effect, small
        prior cost of an effect, and further cost of one that is no larger than in every servo,
        nats.
    outside, outside_beside
        odds of a cause outside of the catalogue without and with an effect in the best set, nats.
    outside_left, outside_explained
        increase of these odds with the ln of the errors left, and with what the best set explains.
    outside_position
        increase of these odds where no pressure is measured, nats.
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


IN_USE = Constants(
    evidence=deciding.EVIDENCE,
    least_left=deciding.LEAST_LEFT,
    effect=deciding.EFFECT,
    small=deciding.SMALL,
    outside=deciding.OUTSIDE,
    outside_beside=deciding.OUTSIDE_BESIDE,
    outside_left=deciding.OUTSIDE_LEFT,
    outside_explained=deciding.OUTSIDE_EXPLAINED,
    outside_position=deciding.OUTSIDE_POSITION,
)
