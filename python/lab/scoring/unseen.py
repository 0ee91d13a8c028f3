# SPDX-License-Identifier: MIT
"""Effects that are not named, against the size from which on a diagnosis says it would see them.

A diagnosis lists the effects that it does not name, each with the smallest size that its records
would have shown with a power of 90 % (`could_be_seen`). An effect that is missed should be smaller
than that: then the user was told that it may be there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis.schema import CouldBeSeen

from .judging import ScoredCase, is_true


@dataclass(frozen=True)
class Unseen:
    """An effect of a machine that its diagnosis does not name."""

    effect: str
    over_limit: float
    """Its size over the one that would have been seen; 0 where the diagnosis says that no size
    would have been seen."""
    told: str
    """Both sizes, in words."""


def unseen_effects(case: ScoredCase) -> tuple[Unseen, ...]:
    """Returns the true effects that no set names and whose visible size the diagnosis tells."""
    if not case.known:
        return ()
    findings = case.findings
    named = {effect.id for effect in findings.named}.union(*findings.sets)
    limits = {each.id: each for each in findings.could_be_seen}
    return tuple(
        _against(limits[effect], sizes)
        for effect, sizes in case.answer.effects.items()
        if effect in limits and not any(is_true(name, [effect]) for name in named)
    )


def _against(limit: CouldBeSeen, sizes: Mapping[str, float]) -> Unseen:
    effect, name = limit.id, limit.parameter
    parameter = next(each for each in effects()[effect].parameters if each.name == name)
    size = sizes[name]
    if limit.limit == "none":
        return Unseen(effect, 0.0, f"{effect} of {name} {size:.3g} would not be seen in any size")
    # The outputs depend on |size - neutral|^(1 / power).
    ratio = abs(size - parameter.neutral) / abs(limit.size - parameter.neutral)
    over = math.pow(ratio, 1.0 / parameter.power)
    side = "smaller" if over < 1.0 else "no smaller"
    words = f"{effect} of {name} {size:.3g} is {side} than {limit.size:.3g}, which would be seen"
    return Unseen(effect, over, words)
