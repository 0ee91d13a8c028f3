# SPDX-License-Identifier: MIT
"""Risk-coverage curve: how often the first name is wrong, against how often there is a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.right import KNOWN, is_true


@dataclass(frozen=True)
class RiskPoint:
    """A point of the risk-coverage curve.

    Attributes
    ----------
    threshold
        lowest probability of the names that are kept.
    coverage
        share of all cases in which the first name is kept.
    risk
        share of the kept names that are wrong.
    """

    threshold: float
    coverage: float
    risk: Figure


def risk_curve(cases: Sequence[Scored]) -> tuple[RiskPoint, ...]:
    """Returns the curve by falling probability, one point for each (El-Yaniv, Wiener, 2010).

    Cases of every kind count: a name in a machine without effects is wrong, and cases in which
    nothing was named keep the coverage below 1. Names of the same probability share one point.
    """
    names = sorted(
        (
            (
                case.said.named[0].probability,
                case.answer.kind not in KNOWN
                or not is_true(case.said.named[0].id, case.answer.effects),
            )
            for case in cases
            if case.said.named
        ),
        reverse=True,
    )
    points = []
    for last, (p, _) in enumerate(names, start=1):
        if last < len(names) and names[last][0] == p:
            continue
        wrong = share(f"named with {p:.2f} and above", [bad for _, bad in names[:last]])
        points.append(RiskPoint(p, last / len(cases), wrong))
    return tuple(points)
