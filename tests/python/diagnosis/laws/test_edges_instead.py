# SPDX-License-Identifier: MIT
"""What unequal metering edges can replace where no pressure is measured: a law, a force."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import OFF, PRESSURES, RIG, record

from ehsid.harness.diagnosis.deciding import FALSE_ALARM, MISSED
from ehsid.harness.diagnosis.decision.hypotheses import posterior
from ehsid.harness.diagnosis.laws.choosing import missing_laws
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.candidates import calibrate, nominal_candidate, refine
from ehsid.harness.diagnosis.search.refit import fitted_to_all
from ehsid.harness.diagnosis.search.search import SearchResult

UNEQUAL = {"nuisance.edge_gain_direction": 0.05}


def case_of(*outputs: str) -> Case:
    return make_case(RIG, *([record({**OFF, **UNEQUAL}, seed, outputs)] for seed in (1, 2)))


@pytest.mark.parametrize("outputs", [("position_m",), PRESSURES])
def test_unequal_edges_are_no_law(outputs: tuple[str, ...]) -> None:
    case = case_of(*outputs)
    calibrated = calibrate(case)
    assert missing_laws(case, calibrated, calibrated) is None


@pytest.mark.slow
@pytest.mark.parametrize(("force_n", "is_ahead"), [(2000.0, False), (6000.0, True)])
def test_a_force_is_ahead_where_edges_would_have_to_be_too_unequal(
    force_n: float, is_ahead: bool
) -> None:
    """6 kN are a seventh of the largest force: edges would differ by 3.4 deviations, 5.8 nats."""
    values = {**OFF, "effects.load_force.force_n": force_n}
    case = make_case(RIG, *([record(values, seed, ("position_m",))] for seed in (1, 2)))
    calibrated = calibrate(case)
    forced = refine(case, ("load_force",), np.append(calibrated.x, 0.5 * force_n))
    found = SearchResult(case, nominal_candidate(case), calibrated, (forced,), ())
    probabilities = posterior(case, calibrated, [forced], fitted_to_all(case, found))
    by_set = {each.effects: each.probability for each in probabilities.sets}
    odds = by_set[("load_force",)] / by_set[()]
    # From these odds on a name loses less than none.
    assert (odds > FALSE_ALARM / MISSED) == is_ahead
    assert (odds < 1.0) == (not is_ahead)


def test_unequal_edges_are_fitted_where_no_pressure_shows_them() -> None:
    found = calibrate(case_of("position_m")).values["nuisance.edge_gain_direction"]
    # Its prior, 0.02, pulls the value towards zero: the sign and half of the size are asked for.
    assert found == pytest.approx(0.05, rel=0.5)
