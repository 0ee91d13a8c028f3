# SPDX-License-Identifier: MIT
"""Cases whose diagnosis is not right, and how far the named effects are behind the fitted truth."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ehsid.harness.diagnosis.schema import Candidate

from .figures import Figure, quantile
from .findings import Findings
from .judging import GAP_SIZES, ScoredCase
from .unseen import unseen_effects

# Two fits that differ by less cannot be told apart by a record. The difference means odds of 150 to
# 1 if only half of the windows are as independent as is assumed.
EQUAL_NATS = 10.0
WORST_FIRST = ("wrong name", "false alarm", "set without the truth", "rejected", "incomplete")


@dataclass(frozen=True)
class Regret:
    """Held-out cost of the named effects less that of the fitted truth, over cases of a check."""

    figures: tuple[Figure, ...]
    """Median and 90th percentile over the cases whose truth is among the candidates, nats. Below
    zero, the named effects explain the held-out data better than the truth, fitted likewise."""
    tried: int
    not_tried: int
    """Number of cases whose truth is among the candidates, and of those where it is not."""


@dataclass(frozen=True)
class WrongCase:
    """A line of the list, in words and ids of effects."""

    name: str
    grade: str
    sensors: str
    """Name, grade and sensors of the case."""
    truth: str
    """True effects, or the kind of the case."""
    said: str
    """Verdict and named effects of the diagnosis; further sets follow after "or"."""
    outcome: str
    """Outcome by the table of `judging`."""
    reasons: tuple[str, ...]
    """Known reasons why the case is hard; may be empty."""


def regret_of(cases: Sequence[ScoredCase]) -> Regret:
    """Computes the regret of all cases whose truth can be fitted, as the catalogue contains it."""
    regrets = [
        behind_truth(case.findings, case.answer.effects) for case in cases if _can_be_fitted(case)
    ]
    nats = [value for value in regrets if value is not None]
    return Regret(
        (
            quantile("regret, median", nats, unit="nats"),
            quantile("regret, 90th percentile", nats, 0.9, unit="nats"),
        ),
        len(nats),
        len(regrets) - len(nats),
    )


def behind_truth(findings: Findings, truth: Collection[str]) -> float | None:
    """Held-out cost of the named effects less that of exactly the true effects, nats.

    Returns None where either set is not among the candidates. Where the file has no
    `held_out_cost`, it returns the difference of `score`.
    """
    winner = _candidate(findings, [effect.id for effect in findings.named])
    true = _candidate(findings, truth)
    if winner is None or true is None:
        return None
    behind = winner.held_out_cost - true.held_out_cost
    return winner.score - true.score if math.isnan(behind) else behind


def wrong_cases(cases: Sequence[ScoredCase]) -> tuple[WrongCase, ...]:
    """Returns the cases whose diagnosis is not right, the worst outcomes first."""
    wrong = [
        WrongCase(
            case.name,
            case.answer.grade,
            case.answer.sensors,
            " + ".join(case.answer.effects) or {"none": "no gap"}.get(case.answer.kind, "values"),
            _in_words(case.findings),
            case.judgement.outcome,
            reasons(case),
        )
        for case in cases
        if not case.judgement.right
    ]
    return tuple(sorted(wrong, key=lambda case: (*_rank(case.outcome), case.grade, case.name)))


def reasons(case: ScoredCase) -> tuple[str, ...]:
    """Returns the reasons, as far as the files show them, why the case is hard."""
    found = []
    findings, truth = case.findings, case.answer.effects
    if findings.gap is not None and case.known and not case.name_required:
        found.append(f"gap of {findings.gap:.2g} x floor, below {GAP_SIZES[0]:g}")
    limit = truth.get("valve_flow_saturation", {}).get("limit")
    reached = max(case.answer.largest_command, default=None)
    if limit is not None and reached is not None and reached < limit:
        found.append(f"largest command {reached:.2g} of rated, below the limit of {limit:.2g}")
    found += [one.told for one in unseen_effects(case)]
    if not _can_be_fitted(case):
        return tuple(found)
    nats = behind_truth(findings, truth)
    if nats is None:
        if _candidate(findings, truth) is None:
            found.append("the truth was never fitted")
    elif nats > EQUAL_NATS:
        found.append(f"the truth, fitted, is better by {nats:.3g} nats on held-out data")
    elif nats >= -EQUAL_NATS:
        found.append(
            f"cannot be distinguished from the truth: {abs(nats):.2g} nats on held-out data"
        )
    else:
        found.append(f"fits better than the truth by {-nats:.3g} nats on held-out data")
    missing = [effect for effect in truth if effect in findings.cannot_judge]
    if missing:
        found.append(f"listed as not to be judged: {', '.join(missing)}")
    return tuple(found)


def _can_be_fitted(case: ScoredCase) -> bool:
    in_catalogue = case.answer.kind != "open" and not case.left_out
    return in_catalogue and bool(case.findings.candidates)


def _candidate(findings: Findings, effects: Collection[str]) -> Candidate | None:
    wanted = set(effects)
    return next((one for one in findings.candidates if set(one.effects) == wanted), None)


def _rank(outcome: str) -> tuple[int, str]:
    return WORST_FIRST.index(outcome) if outcome in WORST_FIRST else len(WORST_FIRST), outcome


def _in_words(findings: Findings) -> str:
    if not findings.named:
        return findings.verdict
    named = " + ".join(effect.id for effect in findings.named)
    return f"{findings.verdict}: " + " or ".join([named, *map(" + ".join, findings.sets[1:])])
