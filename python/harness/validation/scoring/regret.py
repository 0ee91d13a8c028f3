# SPDX-License-Identifier: MIT
"""What the choice cost: held-out likelihood of the winner against that of the refitted truth."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.figures import Figure, quantile
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import Said, Tried


@dataclass(frozen=True)
class Regret:
    """Attributes
    ----------
    figures
        median and 90th percentile over the cases whose truth is among the candidates, nats: below
        zero the winner explains the held-out data better than the truth, fitted likewise.
    tried, not_tried
        cases whose truth is among the candidates, and those in which it never was.
    """

    figures: tuple[Figure, ...]
    tried: int
    not_tried: int


def regret_of(cases: Sequence[Scored]) -> Regret:
    """Of all cases but those whose truth cannot be fitted: it is not in the catalogue."""
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
    """Held-out cost of what was named less that of exactly the true effects, nats.

    None where either is not among the candidates. Without `held_out_cost` in the file it is the
    difference of `score`.
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
