# SPDX-License-Identifier: MIT
"""Fitted values that ended at an end of their range, and so are not values to trust."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...catalogue.keys import ParameterKey
from ..model.case import Case
from .candidates import FittedCandidate

# A fitted value is at an end of its range where less than a thousandth of the range is left.
AT_BOUND = 1e-3


@dataclass(frozen=True)
class AtBound:
    """A fitted value at an end of its range.

    Attributes
    ----------
    key
        full name of the value.
    value
        where the fit ended.
    end
        "lower" or "upper".
    """

    key: ParameterKey
    value: float
    end: str

    @property
    def told(self) -> str:
        """Name, value and end; "of" and the range follow."""
        return f"{self.key} = {self.value:.4g} is at the {self.end} end"


def values_at_bounds(case: Case, best: FittedCandidate) -> tuple[AtBound, ...]:
    """Returns the values of the rig and of the effects that are at an end; nuisances are none."""
    found = []
    for parameter, x in zip(case.parameters(best.effects), best.x, strict=False):
        key = ParameterKey(parameter.name)
        span = parameter.high - parameter.low
        if key.is_nuisance or not 0.0 < span < math.inf:
            continue
        near = AT_BOUND * span
        if parameter.low + near < x < parameter.high - near:
            continue
        end = "lower" if x <= parameter.low + near else "upper"
        found.append(AtBound(key, parameter.value(float(x)), end))
    return tuple(found)
