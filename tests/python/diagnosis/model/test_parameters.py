# SPDX-License-Identifier: MIT
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

import ehsid
from ehsid.harness.catalogue.parameters import effects, plant_parameters
from ehsid.harness.diagnosis import calibration_parameters, effect_parameters
from ehsid.harness.diagnosis.model.parameters import (
    UNSEEN_CENTRE,
)
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.rig import MOST_SIGMAS

RIGS = ROOT / "examples" / "rigs"


@pytest.fixture(params=["bench", "axis", "linear"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return read_rig(RIGS / f"{request.param}.toml")


def test_parameters_are_the_uncertain_values_of_the_rig_and_nuisances(rig: Rig) -> None:
    parameters = calibration_parameters(rig)
    names = [parameter.name for parameter in parameters]
    assert len(set(names)) == len(names)
    held = {name for name, info in plant_parameters().items() if info.held}
    assert held & set(rig.values) or rig.plant != "ehs"
    assert not set(names) & held
    rig_names = {name for name, value in rig.values.items() if value != 0.0} - held
    assert rig_names <= set(names)
    assert all(name.startswith("nuisance.") for name in set(names) - rig_names)
    for parameter in parameters:
        assert parameter.low <= parameter.centre <= parameter.high
        info = plant_parameters()[parameter.name]
        rounding = 1e-12 * abs(info.maximum)
        assert parameter.value(parameter.low) >= info.minimum - rounding
        assert parameter.value(parameter.high) <= info.maximum + rounding
        if parameter.name in rig.values:
            assert parameter.value(parameter.centre) == pytest.approx(rig.values[parameter.name])


def test_the_prior_is_the_uncertainty_of_the_value() -> None:
    rig = read_rig(RIGS / "bench.toml")
    bulk = next(p for p in calibration_parameters(rig) if p.name == "fluid.bulk_modulus_pa")
    sigma = rig.sigma("fluid.bulk_modulus_pa")
    assert bulk.sigma == sigma
    assert bulk.value(bulk.centre + sigma) == pytest.approx(1.1e9 * math.exp(sigma))
    assert bulk.high - bulk.centre == pytest.approx(MOST_SIGMAS * sigma)


def test_a_lag_in_the_rig_file_replaces_the_hidden_spool() -> None:
    with_lag = read_rig(RIGS / "bench.toml")
    without_lag = with_lag.with_values(
        {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
    )
    names = {parameter.name for parameter in calibration_parameters(with_lag)}
    assert "effects.valve_lag.bandwidth_hz" in names
    assert names.isdisjoint({"nuisance.spool_bandwidth_hz", "nuisance.spool_damping"})
    # The spool speed of the valve has a limit nevertheless.
    assert "nuisance.spool_slew_1_s" in names
    names = {parameter.name for parameter in calibration_parameters(without_lag)}
    assert "effects.valve_lag.bandwidth_hz" not in names
    assert {"nuisance.spool_bandwidth_hz", "nuisance.spool_damping"} <= names


def test_without_pressures_some_nuisances_have_another_centre(rig: Rig) -> None:
    with_pressures = calibration_parameters(rig)
    without_pressures = calibration_parameters(rig, pressures=False)
    for parameter, expected in zip(without_pressures, with_pressures, strict=True):
        centre = UNSEEN_CENTRE.get(parameter.name, expected.centre)
        assert parameter == replace(expected, centre=centre)
    if rig.plant == "ehs":
        assert UNSEEN_CENTRE.keys() <= {parameter.name for parameter in with_pressures}
        assert without_pressures != with_pressures


def test_every_nuisance_has_a_prior() -> None:
    """The uncertainty of a positive value is a factor; that of a value of either sign an amount."""
    for name, info in plant_parameters().items():
        low, high = info.fit_ends
        assert info.minimum <= low < high <= info.maximum
        if not name.startswith("nuisance."):
            assert not info.logarithmic
            continue
        assert info.minimum > 0.0 or not info.logarithmic
        start = math.log(info.typical) if info.logarithmic else info.typical
        near, far = (math.log(low), math.log(high)) if info.logarithmic else (low, high)
        assert near <= start <= far
        assert 0.0 < info.sigma < far - near


@pytest.mark.slow
@pytest.mark.parametrize("effect", [effect.id for effect in ehsid.effects()])
@given(share=st.floats(0.0, 1.0))
def test_effects_start_at_their_size_and_stay_in_range(effect: str, share: float) -> None:
    info = next(e for e in ehsid.effects() if e.id == effect)
    start = {p.name: p.minimum + share * (p.maximum - p.minimum) for p in info.parameters}
    for (parameter, x), plant_parameter in zip(
        effect_parameters(effect, start), info.parameters, strict=True
    ):
        assert parameter.low <= x <= parameter.high
        assert parameter.sigma == math.inf
        value = parameter.value(x)
        assert value == pytest.approx(
            max(start[plant_parameter.name], parameter.value(parameter.low))
        )
        h = 1e-6 * max(1.0, abs(x))
        slope = (parameter.value(x + h) - parameter.value(x - h)) / (2.0 * h)
        assert parameter.slope(x) == pytest.approx(slope, rel=1e-6)


def test_an_axis_has_no_effects_of_a_valve() -> None:
    with pytest.raises(ValueError, match="'valve_dead_band' cannot act"):
        effect_parameters("valve_dead_band", {"overlap": 0.02}, "axis")


def test_forces_have_either_sign() -> None:
    ((force, x),) = effect_parameters("load_force", {"force_n": -300.0})
    assert force.value(x) == -300.0
    assert force.low < 0.0 < force.high
    assert np.isfinite([force.low, force.high]).all()


@pytest.mark.parametrize("effect", [info.id for info in ehsid.effects()])
def test_ends_of_a_logarithm_are_inside_the_range_of_the_plant(effect: str) -> None:
    """The values at the bounds of a fit can be written to a rig file and simulated."""
    rig = read_rig(RIGS / "bench.toml")
    ranges = {info.name: info for info in ehsid.plant_parameters()}
    start = {parameter.name: parameter.typical for parameter in effects()[effect].parameters}
    parameters = [parameter for parameter, _ in effect_parameters(effect, start)]
    for parameter in (*parameters, *calibration_parameters(rig)):
        info = ranges[parameter.name]
        assert info.minimum <= parameter.value(parameter.low), parameter.name
        assert parameter.value(parameter.high) <= info.maximum, parameter.name
