# SPDX-License-Identifier: MIT
"""Tables as parts of a fit: their prior, and their sensitivities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from gap_cases import RIG, record
from scipy.special import kv

from ehsid.harness.diagnosis import calibration_parameters
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.parameters import LENGTH, NUGGET, Law, block_basis
from ehsid.harness.diagnosis.model.problem import Problem

KNOTS = np.linspace(-0.1, 0.3, 7)
LAW = Law("force", "position_m", KNOTS, 400.0)
SPOOL = Law("spool", "spool", np.array([-0.5, -0.05, 0.0, 0.05, 0.5]), 0.1)


def problem(laws: Sequence[Law]) -> Problem:
    parameters = calibration_parameters(RIG)[:2]
    names = ("position_m", "pressure_a_pa", "pressure_b_pa")
    floors = {"position_m": 5e-6, "pressure_a_pa": 1e4, "pressure_b_pa": 1e4}
    compared = compare(record({}, 3, seconds=3.0))
    return Problem(RIG, [compared], parameters, outputs=names, floors=floors, substeps=2, laws=laws)


def test_the_prior_is_a_matern_covariance_over_the_places_of_the_knots() -> None:
    # The general formula with the modified Bessel function, of order 5/2.
    distance = np.abs(np.subtract.outer(np.arange(7), np.arange(7)))
    argument = math.sqrt(5.0) * np.maximum(distance, 1e-12) / LENGTH
    matern = 2.0**-1.5 / math.gamma(2.5) * argument**2.5 * kv(2.5, argument)
    expected = 400.0**2 * (matern + NUGGET * np.eye(7))
    np.testing.assert_allclose(LAW.basis @ LAW.basis.T, expected, rtol=1e-9, atol=1e-6)


def test_the_parameters_of_a_law_give_its_values_in_the_plant() -> None:
    subject = problem([LAW, SPOOL])
    z = np.random.default_rng(2).standard_normal(KNOTS.size + SPOOL.knots.size)
    values = subject.plant_values(np.concatenate([subject.centre()[:2], z]))
    first, second = LAW.table(z[:7]), SPOOL.table(z[7:])
    np.testing.assert_allclose(values[-12:], [*first.values, *second.values], rtol=1e-12)
    assert (first.adds_to, first.of, first.knots) == ("force", "position_m", tuple(KNOTS))
    np.testing.assert_allclose(block_basis([LAW, SPOOL]) @ z, values[-12:], rtol=1e-12)


def test_a_law_of_zero_changes_nothing() -> None:
    without, with_law = problem([]), problem([LAW, SPOOL])
    x = without.centre()
    longer = np.concatenate([x, np.zeros(12)])
    assert with_law.cost(longer) == pytest.approx(without.cost(x), rel=1e-12)


@pytest.mark.parametrize("law", [LAW, SPOOL], ids=lambda law: law.name)
def test_sensitivities_are_those_of_differences(law: Law) -> None:
    subject = problem([law])
    rng = np.random.default_rng(4)
    x = np.concatenate([subject.centre()[:2], 0.3 * rng.standard_normal(law.knots.size)])
    linear = subject.linear(x)
    for i in range(x.size):
        step = np.zeros(x.size)
        # Rounding of 1e-16 against curvature: the cube root, on the scale of the parameters.
        step[i] = 1e-5
        ahead, behind = (subject.coefficients(x + sign * step) for sign in (1.0, -1.0))
        for name in subject.outputs:
            differences = (ahead[name] - behind[name]) / 2e-5
            scale = np.abs(differences).max()
            np.testing.assert_allclose(
                linear.slopes[name][:, i], differences, rtol=0.0, atol=2e-4 * scale
            )
