# SPDX-License-Identifier: MIT
"""Least sizes of effects."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gap_rig import RIG

import ehsid
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis.model.scale import machine_scale
from ehsid.harness.diagnosis.search.intervals import (
    MARGIN_STEP,
    largest_usual,
    margin,
    matters,
    simpler_part,
    too_large,
)

FITTED = [info for info in ehsid.effects() if info.id != "sensor_quantisation"]


def test_scales_by_hand() -> None:
    scale = machine_scale(RIG)
    assert scale.force_n == pytest.approx(3.1172e-3 * 12e6, rel=1e-3)
    assert scale.rated_flow_m3_s == 6.33e-4
    # 6.33e-4 sqrt(6 MPa / 3.5 MPa)
    assert scale.full_flow_m3_s == pytest.approx(8.288e-4, rel=1e-3)
    assert scale.pressure_pa == 12e6
    assert scale.stroke_m == 0.3


@pytest.mark.parametrize("effect", FITTED, ids=lambda info: info.id)
def test_typical_sizes_of_the_catalogue_matter(effect: ehsid.EffectInfo) -> None:
    values = {f"effects.{effect.id}.{p.name}": p.typical for p in effect.parameters}
    assert matters(effect.id, values, RIG)


@pytest.mark.parametrize("effect", FITTED, ids=lambda info: info.id)
def test_an_effect_as_good_as_off_does_not(effect: ehsid.EffectInfo) -> None:
    """Off means zero; a fast lag and a limit that is never reached are off as well."""
    off = {"valve_lag": 500.0, "valve_flow_saturation": 2.0}.get(effect.id, 0.0)
    values = {f"effects.{effect.id}.{p.name}": off for p in effect.parameters}
    assert not matters(effect.id, values, RIG)


def test_stribeck_friction_without_a_rise_is_not_one() -> None:
    values = {
        "effects.stribeck_friction.coulomb_n": 800.0,
        "effects.stribeck_friction.static_n": 810.0,
        "effects.stribeck_friction.stribeck_velocity_m_s": 0.02,
    }
    assert not matters("stribeck_friction", values, RIG)
    assert matters(
        "stribeck_friction", values | {"effects.stribeck_friction.static_n": 1200.0}, RIG
    )


@pytest.mark.parametrize(
    ("effect", "small", "large"),
    [
        ("load_spring", (-1e3, 500.0), (-2e3, 500.0)),
        ("counterbalance_valve", (1.5e7, 3.0), (2.2e7, 2.0)),
        # It must begin within the stroke.
        ("contact_spring", (0.295, 5e4), (0.25, 5e4)),
        # Sound transducers, and pressures that are told above the atmosphere.
        ("pressure_sensor_gain", (1.015, 0.0), (0.0, 0.97)),
        ("pressure_sensor_offset", (-1.013e5, -1.013e5), (0.0, 1.5e5)),
        ("pressure_sensor_lag", (1e-3,), (3e-3,)),
        ("position_sensor_delay", (0.9e-3,), (1.1e-3,)),
    ],
)
def test_what_a_sound_machine_has_does_not_matter(
    effect: str, small: tuple[float, ...], large: tuple[float, ...]
) -> None:
    names = [f"effects.{effect}.{parameter.name}" for parameter in effects()[effect].parameters]
    assert not matters(effect, dict(zip(names, small, strict=True)), RIG)
    assert matters(effect, dict(zip(names, large, strict=True)), RIG)


@pytest.mark.parametrize(
    ("effect", "sizes", "large"),
    [
        ("stribeck_friction", (583.0, 23272.0, 1e-4), True),
        ("stribeck_friction", (800.0, 810.0, 0.02), False),
        ("coulomb_friction_sides", (561.0, 610.0), False),
        ("position_friction", (587.0, -0.8), False),
    ],
)
def test_a_law_beside_the_one_that_it_contains_is_too_large_or_too_small(
    effect: str, sizes: tuple[float, ...], large: bool
) -> None:
    names = [parameter.name for parameter in effects()[effect].parameters]
    values = {f"effects.{effect}.{name}": size for name, size in zip(names, sizes, strict=True)}
    assert not matters(effect, values, RIG)
    assert simpler_part(effect, values, RIG) == "coulomb_friction"
    assert too_large(effect, values, RIG) == large
    tiny = {name: 1e-6 * size for name, size in values.items()}
    assert simpler_part(effect, tiny, RIG) is None


def test_a_law_that_is_too_large_matters_with_less_of_one_size() -> None:
    """Friction at rest is at most three times that at speed: 1749 N here."""
    sizes = {"coulomb_n": 583.0, "static_n": 6580.0, "stribeck_velocity_m_s": 2e-3}
    values = {f"effects.stribeck_friction.{name}": size for name, size in sizes.items()}
    usual = largest_usual("stribeck_friction", values, RIG)
    (size,) = usual.values()
    assert usual == {"effects.stribeck_friction.static_n": size}
    assert 0.95 * 1749.0 < size <= 1749.0
    assert matters("stribeck_friction", values | usual, RIG)


def test_an_effect_that_contains_no_other_has_no_simpler_part() -> None:
    assert simpler_part("load_force", {"effects.load_force.force_n": 1e4}, RIG) is None


def _larger(effect: ehsid.EffectInfo, factor_ln: float) -> dict[str, float]:
    """The typical sizes, changed so that the outputs change by a factor, given by its ln."""
    return {
        f"effects.{effect.id}.{p.name}": p.neutral
        + (p.typical - p.neutral) * math.exp(factor_ln * p.power)
        for p in effect.parameters
    }


@pytest.mark.parametrize("effect", FITTED, ids=lambda info: info.id)
def test_the_margin_is_the_ln_of_the_factor_over_the_least_size(effect: ehsid.EffectInfo) -> None:
    # The least size lies between a thousandth of the typical one, ln -7, and the typical one.
    low, high = -7.0, 0.0
    assert not matters(effect.id, _larger(effect, low), RIG)
    for _ in range(60):
        middle = 0.5 * (low + high)
        is_large = matters(effect.id, _larger(effect, middle), RIG)
        low, high = (low, middle) if is_large else (middle, high)
    assert margin(effect.id, _larger(effect, high), RIG) <= MARGIN_STEP
    for beyond in np.linspace(0.0, 0.99, 34):
        found = margin(effect.id, _larger(effect, high + beyond), RIG)
        # Bisection ends at a margin with which the effect still matters.
        assert found == pytest.approx(beyond, abs=MARGIN_STEP)
    for beyond in (1.0 + 1e-9, 1.1, 2.0, 3.0):
        assert margin(effect.id, _larger(effect, high + beyond), RIG) == 1.0
