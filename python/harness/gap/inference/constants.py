# SPDX-License-Identifier: MIT
"""The constants of the probabilities as one value, so that others can be put in their place."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.gap.deciding import (
    EFFECT,
    EVIDENCE,
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
    evidence=EVIDENCE,
    least_left=LEAST_LEFT,
    effect=EFFECT,
    small=SMALL,
    outside=OUTSIDE,
    outside_beside=OUTSIDE_BESIDE,
    outside_left=OUTSIDE_LEFT,
    outside_explained=OUTSIDE_EXPLAINED,
    outside_position=OUTSIDE_POSITION,
)
