# SPDX-License-Identifier: MIT
"""The list of wrong cases, their reasons, and how far the names are behind the truth."""

import math

import pytest
from scored_cases import BAND, BIAS, CANDIDATES, LAG, case, findings

from ehsid.harness.diagnosis.schema import Candidate
from ehsid.lab.scoring.judging import ScoredCase
from ehsid.lab.scoring.wrong import behind_truth, reasons, regret_of, wrong_cases


@pytest.mark.parametrize(
    ("named", "truth", "nats"),
    [((BIAS,), (BIAS,), 0.0), ((BIAS,), (BAND,), -4.0), ((BAND, LAG), (BIAS,), 9.0)],
)
def test_regret_is_the_difference_on_held_out_data(
    named: tuple[str, ...], truth: tuple[str, ...], nats: float
) -> None:
    assert behind_truth(findings(*named), truth) == pytest.approx(nats)
    only_scores = tuple(Candidate(one.effects, one.score, 0.0) for one in CANDIDATES)
    assert behind_truth(findings(*named, candidates=only_scores), truth) == pytest.approx(nats)


def test_regret_counts_what_was_never_fitted() -> None:
    found = regret_of([case(findings(BIAS), BIAS), case(findings(BIAS), LAG)])
    assert (found.tried, found.not_tried) == (1, 1)
    assert math.isclose(found.figures[0].value, 0.0)
    assert behind_truth(findings(), ()) == 0.0


@pytest.mark.parametrize(
    ("subject", "words"),
    [
        (case(findings(BIAS), BAND), "cannot be distinguished from the truth: 4 nats"),
        (case(findings(BIAS), LAG), "the truth was never fitted"),
        (case(findings(), BAND), "the truth, fitted, is better by 56 nats"),
        (case(findings(BIAS), kind="none"), "fits better than the truth by 60 nats"),
        (case(findings(BIAS, gap=2.0), BAND), "gap of 2 x floor"),
        (case(findings(BIAS), "valve_flow_saturation"), "largest command 0.5 of rated, below"),
        (
            case(findings(BIAS, cannot_judge=frozenset([BAND])), BAND),
            "not to be judged: valve_dead",
        ),
    ],
)
def test_reasons(subject: ScoredCase, words: str) -> None:
    assert any(one.startswith(words) or words in one for one in reasons(subject))


def test_the_list_has_the_worst_first_and_nothing_that_is_right() -> None:
    cases = [case(findings(), BAND), case(findings(BIAS), BIAS), case(findings(BIAS), BAND)]
    assert [one.outcome for one in wrong_cases(cases)] == ["wrong name", "missed"]
    assert wrong_cases(cases)[0].said == "effects: valve_null_bias"
