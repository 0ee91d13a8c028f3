# SPDX-License-Identifier: MIT
"""A simulator that nearly agrees as configured speaks for it that nothing is missing."""

from __future__ import annotations

from typing import Any

import gap_cases as made
import pytest

from ehsid.harness.diagnosis import diagnosis
from ehsid.harness.diagnosis.deciding import AGREES, NEAR_GAP
from ehsid.harness.diagnosis.options import DiagnosisOptions


@pytest.mark.parametrize(
    ("values", "agrees"),
    [
        ({}, True),
        ({"valve.rated_flow_m3_s": 0.85 * made.RIG.values["valve.rated_flow_m3_s"]}, False),
    ],
)
def test_a_small_gap_as_configured_counts_before_the_answer(
    values: dict[str, float], agrees: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluated: list[Any] = []

    def kept(evaluation: Any, *_rest: object) -> Any:
        evaluated.append(evaluation)
        return evaluation

    monkeypatch.setattr(diagnosis, "_with_missing_laws", kept)
    fitted, held_out = (made.record(values, seed) for seed in (1, 2))
    options = DiagnosisOptions(exclude=made.all_but("valve_dead_band"))
    diagnosis.diagnose([fitted], made.RIG, validate=[held_out], options=options)
    (evaluation,) = evaluated
    assert (evaluation.reduction.nominal <= NEAR_GAP) == agrees
    posterior = evaluation.selection.posterior
    assert posterior.agreement == (AGREES if agrees else 0.0)
    assert evaluation.selection.answer.kind == "healthy"
