# SPDX-License-Identifier: MIT
"""What may be the answer is fitted again, once it is known what unlogged commands can do."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_candidates import CASE, FLOOR, candidate, search_result

from ehsid.harness.diagnosis.model.case import Case
from ehsid.harness.diagnosis.search import refit
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.refit import BEHIND, fitted_again
from ehsid.harness.diagnosis.search.score import score_of


def test_the_rig_and_the_likely_sets_are_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    near, far = candidate("sensor_lag", rms=2.0 * FLOOR), candidate("coulomb_friction", rms=1e-4)
    found = search_result(candidate(rms=100.0 * FLOOR), near, far)
    best = score_of(CASE, near)
    assert score_of(CASE, far) < best - BEHIND
    assert score_of(CASE, found.calibrated) < best - BEHIND
    asked = []

    def better(case: Case, effects: tuple[str, ...], x: object) -> FittedCandidate:
        assert case is CASE
        start = found.calibrated if not effects else near
        assert x is start.x
        asked.append(effects)
        # Worse on held-out data than what is not fitted again, so that the order changes.
        return replace(start, cost=start.cost - 1.0, held_out_cost=far.held_out_cost + 1.0)

    monkeypatch.setattr(refit, "refine_finely", better)
    again = fitted_again(CASE, found)
    assert sorted(asked) == [(), ("sensor_lag",)]
    assert again.calibrated.cost == found.calibrated.cost - 1.0
    assert again.refined[0] is far
    assert again.refined[1].cost == near.cost - 1.0
    assert again.nominal is found.nominal
    assert again.screened is found.screened
