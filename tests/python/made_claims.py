# SPDX-License-Identifier: MIT
"""Findings on the claims of the paper, made up: each finding occurs for each claim."""

from __future__ import annotations

from itertools import cycle, product

from ehsid.lab.studies.claims import (
    Comparison,
    Condition,
    Finding,
    Input,
    Interval,
    Judged,
    ResetJudged,
)
from ehsid.lab.studies.experiment import FACTORS, LAMBDA0S, NOISES, P0S, ClaimResults
from ehsid.lab.studies.verdicts import verdicts


def made_claims() -> ClaimResults:
    """Findings on all conditions of the experiment; neighbours differ."""
    findings = cycle(Finding)

    def compared() -> Comparison:
        return Comparison(Interval(0.5, 0.4, 0.6), next(findings))

    judged = [
        Judged(
            Condition(p0, noise, kind, lambda0),
            compared(),
            compared(),
            compared(),
            Interval(1.0 / (1.0 + p0), 0.9 / (1.0 + p0), 1.1 / (1.0 + p0)),
        )
        for p0, noise, kind, lambda0 in product(P0S, NOISES, Input, LAMBDA0S)
    ]
    resets = [
        ResetJudged(noise, factor, compared(), Interval(9.0, 8.0, 10.0), 0.5, 0.0)
        for noise, factor in product(NOISES, FACTORS)
    ]
    return ClaimResults(judged, resets, verdicts(judged, resets), 0.5, 0.29)
