# SPDX-License-Identifier: MIT
"""Laws that unequal metering edges can replace, where no pressure is measured."""

from __future__ import annotations

import pytest
from gap_cases import OFF, PRESSURES, RIG, record

from ehsid.harness.diagnosis.laws.choosing import missing_laws
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.candidates import calibrate

UNEQUAL = {"nuisance.edge_gain_direction": 0.05}


def case_of(*outputs: str) -> Case:
    return make_case(RIG, *([record({**OFF, **UNEQUAL}, seed, outputs)] for seed in (1, 2)))


@pytest.mark.parametrize("outputs", [("position_m",), PRESSURES])
def test_unequal_edges_are_no_law(outputs: tuple[str, ...]) -> None:
    case = case_of(*outputs)
    calibrated = calibrate(case)
    assert missing_laws(case, calibrated, calibrated) is None


@pytest.mark.slow
@pytest.mark.parametrize(("force_n", "is_told"), [(2000.0, False), (6000.0, True)])
def test_a_constant_force_is_a_law_where_edges_would_have_to_be_too_unequal(
    force_n: float, is_told: bool
) -> None:
    """6 kN are a seventh of the largest force: edges would differ by several deviations."""
    values = {**OFF, "effects.load_force.force_n": force_n}
    case = make_case(RIG, *([record(values, seed, ("position_m",))] for seed in (1, 2)))
    calibrated = calibrate(case)
    found = missing_laws(case, calibrated, calibrated)
    told = [] if found is None else [law.looks_like for law in found.laws]
    assert [text.endswith("as a load force") for text in told] == [True] * is_told


def test_unequal_edges_are_fitted_where_no_pressure_shows_them() -> None:
    found = calibrate(case_of("position_m")).values["nuisance.edge_gain_direction"]
    # Its prior, 0.02, pulls the value towards zero: the sign and half of the size are asked for.
    assert found == pytest.approx(0.05, rel=0.5)
