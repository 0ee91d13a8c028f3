# SPDX-License-Identifier: MIT
"""Regret of the choice: held-out cost of the named effects against that of the fitted truth."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.figures import Figure, quantile
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import Said, Tried


@dataclass(frozen=True)
class Regret:
    """Regret over the cases of a check.

    Attributes
    ----------
    figures
        median and 90th percentile over the cases whose truth is among the candidates, nats. Below
        zero, the named effects explain the held-out data better than the truth, fitted likewise.
    tried, not_tried
        number of cases whose truth is among the candidates, and of those where it is not.
    """

    figures: tuple[Figure, ...]
    tried: int
    not_tried: int


def regret_of(cases: Sequence[Scored]) -> Regret:
    """Computes the regret of all cases whose truth can be fitted, as the catalogue contains it."""
    could = [
        case
        for case in cases
        if case.answer.kind != "open" and not case.left_out and case.said.tried
    ]
    found = [behind_truth(case.said, case.answer.effects) for case in could]
    nats = [value for value in found if value is not None]
    return Regret(
        (
            quantile("regret, median", nats, unit="nats"),
            quantile("regret, 90th percentile", nats, 0.9, unit="nats"),
        ),
        len(nats),
        len(found) - len(nats),
    )


def behind_truth(said: Said, truth: Collection[str]) -> float | None:
    """Held-out cost of the named effects less that of exactly the true effects, nats.

    Returns None where either set is not among the candidates. Where the file has no
    `held_out_cost`, it returns the difference of `score`.
    """
    winner = _candidate(said, [one.id for one in said.named])
    true = _candidate(said, truth)
    if winner is None or true is None:
        return None
    if winner.held_out_cost is not None and true.held_out_cost is not None:
        return winner.held_out_cost - true.held_out_cost
    return winner.score - true.score


def _candidate(said: Said, effects: Collection[str]) -> Tried | None:
    return next((one for one in said.tried if set(one.effects) == set(effects)), None)
