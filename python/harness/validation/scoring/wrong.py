# SPDX-License-Identifier: MIT
"""List of all cases whose diagnosis is not right, with what may have made them hard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.judged_case import GAP_SIZES, Scored
from ehsid.harness.validation.scoring.regret import behind_truth
from ehsid.harness.validation.scoring.right import KNOWN

# Two fits that differ by less cannot be told apart by a record. The difference means odds of 150 to
# 1 if only half of the windows are as independent as is assumed.
EQUAL_NATS = 10.0


@dataclass(frozen=True)
class WrongCase:
    """A line of the list, in words and ids of effects.

    Attributes
    ----------
    name, grade, sensors
        name, grade and sensors of the case.
    truth
        true effects, or the kind of the case.
    said
        verdict and named effects of the diagnosis; further sets follow after "or".
    outcome
        outcome by the table of `right`.
    reasons
        known reasons why the case is hard; may be empty.
    """

    name: str
    grade: str
    sensors: str
    truth: str
    said: str
    outcome: str
    reasons: tuple[str, ...]


def wrong_cases(cases: Sequence[Scored]) -> tuple[WrongCase, ...]:
    """Returns the cases whose diagnosis is not right, the worst outcomes first."""
    order = ("wrong name", "false alarm", "set without the truth", "rejected", "incomplete")
    wrong = [case for case in cases if not case.judged.right]
    wrong.sort(
        key=lambda case: (
            order.index(case.judged.outcome) if case.judged.outcome in order else len(order),
            case.judged.outcome,
            case.answer.grade,
            case.name,
        )
    )
    return tuple(
        WrongCase(
            case.name,
            case.answer.grade,
            case.answer.sensors,
            " + ".join(case.answer.effects) or {"none": "no gap"}.get(case.answer.kind, "values"),
            _said(case),
            case.judged.outcome,
            reasons(case),
        )
        for case in wrong
    )


def _said(case: Scored) -> str:
    named = " + ".join(one.id for one in case.said.named)
    others = [" + ".join(one) for one in case.said.sets[1:]]
    return ": ".join([case.said.verdict, *([" or ".join([named, *others])] if named else [])])


def reasons(case: Scored) -> tuple[str, ...]:
    """Returns the reasons, as far as the files show them, why the case is hard."""
    found = []
    if case.said.gap is not None and case.answer.kind in KNOWN and not case.demanded:
        found.append(f"gap of {case.said.gap:.2g} x floor, below {GAP_SIZES[0]:g}")
    limit = case.answer.effects.get("valve_flow_saturation", {}).get("limit")
    if limit is not None and case.answer.largest_command < limit:
        reached = case.answer.largest_command
        found.append(f"largest command {reached:.2g} of rated, below the limit of {limit:.2g}")
    if case.answer.kind == "open" or case.left_out or not case.said.tried:
        return tuple(found)
    nats = behind_truth(case.said, case.answer.effects)
    if nats is None:
        if not any(set(one.effects) == set(case.answer.effects) for one in case.said.tried):
            found.append("the truth was never fitted")
    elif nats > EQUAL_NATS:
        found.append(f"the truth, fitted, is better by {nats:.3g} nats on held-out data")
    elif nats >= -EQUAL_NATS:
        found.append(f"not to be told from the truth: {abs(nats):.2g} nats on held-out data")
    else:
        found.append(f"fits better than the truth by {-nats:.3g} nats on held-out data")
    missing = [one for one in case.answer.effects if one in case.said.cannot_judge]
    if missing:
        found.append(f"listed as not to be judged: {', '.join(missing)}")
    return tuple(found)
