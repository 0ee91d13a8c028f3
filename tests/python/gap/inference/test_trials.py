# SPDX-License-Identifier: MIT
"""Sizes of effects from the factors of their trials, and the powers that the effects state."""

import numpy as np
import pytest

import ehsid
from ehsid.harness.catalogue.keys import effect_values
from ehsid.harness.catalogue.parameters import effects, plant_parameters
from ehsid.harness.gap.inference.trials import scaled


def terms(effect: str, **sizes: float) -> ehsid.EffectTerms:
    values = effect_values(effect, sizes)
    return ehsid.EffectTerms([values.get(name, 0.0) for name in plant_parameters()])


def test_a_proportional_size_is_multiplied() -> None:
    sizes = scaled(effects()["coulomb_friction"], [{"force_n": 300.0}], np.array([1.5]))
    assert sizes == {"force_n": 450.0}


def test_columns_of_one_effect_are_summed_and_its_form_stays() -> None:
    columns = [
        {"coulomb_n": 100.0, "static_n": 100.0, "stribeck_velocity_m_s": 0.02},
        {"coulomb_n": 0.0, "static_n": 100.0, "stribeck_velocity_m_s": 0.02},
    ]
    sizes = scaled(effects()["stribeck_friction"], columns, np.array([2.0, 0.5]))
    assert sizes == {"coulomb_n": 200.0, "static_n": 250.0, "stribeck_velocity_m_s": 0.02}


@pytest.mark.parametrize("factor", [0.0, -1.0])
def test_a_size_that_no_factor_gives_is_outside_its_range(factor: float) -> None:
    sizes = scaled(effects()["valve_flow_saturation"], [{"limit": 0.6}], np.array([factor]))
    assert sizes["limit"] < effects()["valve_flow_saturation"].parameters[0].minimum


def test_the_power_of_a_limit_is_that_of_what_it_takes_away() -> None:
    """A limit L takes away x - L tanh(x / L) = x^3 / (3 L^2) of a small opening x."""
    opening = np.linspace(0.01, 0.1, 10)
    taken = []
    for factor in (1.0, 4.0):
        sizes = scaled(effects()["valve_flow_saturation"], [{"limit": 1.5}], np.array([factor]))
        taken.append(opening - terms("valve_flow_saturation", **sizes).opening(opening))
    # The next term of the series is 2 / 5 of (x / L)^2.
    np.testing.assert_allclose(taken[1], 4.0 * taken[0], rtol=0.4 * (0.1 / 0.75) ** 2)


def test_the_power_of_a_bandwidth_is_that_of_the_delay() -> None:
    """A second-order lag delays slow commands by 2 zeta / w."""
    sizes = scaled(
        effects()["valve_lag"], [{"bandwidth_hz": 60.0, "damping": 0.8}], np.array([2.0])
    )
    assert sizes == {"bandwidth_hz": 30.0, "damping": 0.8}
    delays = [2.0 * 0.8 / (2.0 * np.pi * hz) for hz in (60.0, sizes["bandwidth_hz"])]
    assert delays[1] == pytest.approx(2.0 * delays[0])
