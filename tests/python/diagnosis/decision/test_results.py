# SPDX-License-Identifier: MIT
"""Fitted values as results of the diagnosis."""

import math

import gap_cases as made
import pytest

from ehsid.harness.diagnosis.decision.results import calibration_of, in_sigmas
from ehsid.harness.diagnosis.model.parameters import Parameter
from ehsid.harness.diagnosis.schema import Estimate


@pytest.mark.parametrize("names", [made.PRESSURES, ("position_m",)])
def test_a_fitted_value_is_in_deviations_of_the_prior_that_its_fit_used(
    names: tuple[str, ...],
) -> None:
    """Where no pressure is measured, the prior of the atmosphere has another centre."""
    case = made.case_of({}, names)
    centres = {parameter.name: parameter.value(parameter.centre) for parameter in case.parameters()}
    estimates = {name: Estimate(value, value, value) for name, value in centres.items()}
    calibration = calibration_of(case, estimates, dict.fromkeys(estimates, False))
    assert "nuisance.atmosphere" in calibration
    for parameter in case.parameters():
        name = parameter.name
        assert calibration[name].rig == centres[name]
        deviations = in_sigmas(parameter, estimates[name])
        assert deviations is not None, name
        # exp(log(x)) differs from x by a few units in the last place.
        assert deviations.value == pytest.approx(0.0, abs=1e-9), name


def test_deviations_are_those_of_the_logarithm_where_the_prior_is() -> None:
    prior = Parameter("load.mass_kg", True, math.log(120.0), 0.05, math.log(60.0), math.log(240.0))
    deviations = in_sigmas(prior, Estimate(120.0 * math.exp(0.1), 120.0, math.inf))
    assert deviations is not None
    assert deviations.value == pytest.approx(2.0)
    assert deviations.low == pytest.approx(0.0, abs=1e-12)
    assert deviations.high == math.inf
    endless = Parameter("effects.load_force.force_n", False, 0.0, math.inf, -1e4, 1e4)
    assert in_sigmas(endless, Estimate(1.0, 0.0, 2.0)) is None
