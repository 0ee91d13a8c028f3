# SPDX-License-Identifier: MIT
"""The simulator against a separate solution with tight tolerances: every effect, and random rigs.

The integration is of second order: halving its step divides the error by four. So agreement is
shown in two ways: the error is small, and it goes to zero at the rate of the method, which a
difference between the two models would stop.
"""

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import typical

import ehsid

HYDRAULIC = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")
EFFECTS = {effect.id: effect for effect in ehsid.effects()}
# Kinks where the method loses its rate: reversals of friction; the reading of a play, which the
# reference follows on a grid; readings that flip by a whole step.
WITHOUT_RATE = {
    "coulomb_friction",
    "coulomb_friction_sides",
    "stribeck_friction",
    "position_friction",
    "sensor_backlash",
    "sensor_quantisation",
}
MECHANICAL = (
    "coulomb_friction",
    "coulomb_friction_sides",
    "stribeck_friction",
    "position_friction",
    "load_spring",
    "load_force",
    "contact_spring",
    "flexible_load",
)


def test_every_effect_of_the_catalogue_is_here() -> None:
    assert len(EFFECTS) == 33
    assert EFFECTS.keys() >= WITHOUT_RATE


@pytest.mark.slow
@pytest.mark.parametrize("effect", [None, *EFFECTS])
def test_servo_with_one_effect(effect: str | None) -> None:
    values = typical() if effect is None else runs.with_effect(EFFECTS[effect])
    command = runs.steps(0, 60, 10, 9.0)
    expected = runs.reference(values, command)
    coarse, medium, fine = (
        runs.worst_error(runs.simulate(values, command, substeps), expected, HYDRAULIC)
        for substeps in (8, 16, 32)
    )
    assert fine < 1e-3
    if effect not in WITHOUT_RATE:
        # Four in the limit, and the next term of the error is of relative size omega h = 0.2 here;
        # where two terms of opposite sign cancel it falls faster.
        assert coarse / medium > 3.0
        assert medium / fine > 3.0


@pytest.mark.slow
@pytest.mark.parametrize("rate", [-3.0, 3.0])
def test_a_flow_that_changes_much_in_a_short_record(rate: float) -> None:
    values = typical() | {"effects.flow_gain_drift.rate_1_s": rate}
    command = runs.steps(0, 100, 10, 6.0)
    expected = runs.reference(values, command)
    coarse, fine = (
        runs.worst_error(runs.simulate(values, command, substeps), expected, HYDRAULIC)
        for substeps in (16, 32)
    )
    assert fine < 1e-3
    assert coarse / fine > 3.0


@pytest.mark.slow
def test_the_supply_falls_as_the_reference_says() -> None:
    values = runs.with_effect(EFFECTS["supply_droop"])
    command = runs.steps(1, 100, 10, 6.0)
    expected = runs.reference(values, command)
    assert np.ptp(expected["supply_pressure_pa"]) > 1e5
    found = runs.simulate(values, command, 32)
    assert runs.worst_error(found, expected, ("supply_pressure_pa",)) < 1e-3


def test_spool_is_exact_at_any_step() -> None:
    values = runs.with_effect(EFFECTS["valve_lag"])
    command = runs.steps(2, 60, 10, 6.0)
    expected = runs.reference(values, command)["spool"]
    # The reference is good to its tolerance of 1e-9 a step, sixty steps.
    np.testing.assert_allclose(runs.simulate(values, command, 2)["spool"], expected, atol=1e-7)


@pytest.mark.parametrize("substeps", [1, 2, 4])
def test_no_pressure_rings_where_a_small_volume_fills_fast(substeps: int) -> None:
    """The valve wide open into a small volume behind a load that hardly moves: supply pressure.

    The time constant falls far below the step as the drop over the valve goes to zero. There the
    method must damp (L-stability); one that is only stable swings about the supply for long.
    """
    values = typical() | {
        "load.mass_kg": 1e7,
        "cylinder.dead_volume_a_m3": 1e-4,
        "cylinder.dead_volume_b_m3": 1e-4,
        "initial.position_m": 0.002,
    }
    supply = values["supply.pressure_pa"]
    pressure = runs.simulate(values, np.full(30, 10.0), substeps)["pressure_a_pa"]
    assert abs(pressure[0] / supply - 1.0) > 0.5
    # At the end the rod moves with 0.2 mm/s and takes 0.7 cm^3/s. At the laminar slope of the edge,
    # 2.4e-9 m^3/s/Pa, that is a drop of 0.3 kPa, or 2.4e-5 of the supply; four times as much.
    np.testing.assert_allclose(pressure[6:], supply, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("lag", ["hidden", pytest.param("told", marks=pytest.mark.thorough)])
def test_a_spool_that_is_limited_in_speed(lag: str) -> None:
    values = typical() if lag == "hidden" else runs.with_effect(EFFECTS["valve_lag"])
    values = values | {"nuisance.spool_slew_1_s": 40.0}
    command = runs.steps(2, 60, 10, 6.0)
    expected = runs.reference(values, command, method="Radau")
    free = runs.reference(values | {"nuisance.spool_slew_1_s": 1e4}, command)
    assert runs.worst_error(free, expected, ("spool",)) > 0.02
    # The limit begins and ends within a step: of first order.
    errors = [
        runs.worst_error(runs.simulate(values, command, substeps), expected, ("spool",))
        for substeps in (8, 32, 128)
    ]
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 2e-3
    # A steady limit: from one level to another at this speed.
    spool = runs.simulate(values, command, 32)["spool"]
    assert np.abs(np.diff(spool)).max() <= 40.0 * runs.DT_S * (1.0 + 1e-9)


def test_a_null_bias_as_delivered_is_one_of_the_catalogue() -> None:
    command = runs.steps(2, 60, 10, 6.0)
    hidden = runs.simulate(typical() | {"nuisance.null_bias": 0.003}, command, 4)
    named = runs.simulate(typical() | {"effects.valve_null_bias.offset": 0.003}, command, 4)
    for name in HYDRAULIC:
        np.testing.assert_allclose(hidden[name], named[name], rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("effect", [None, *MECHANICAL])
def test_axis(effect: str | None) -> None:
    values = typical() if effect is None else runs.with_effect(EFFECTS[effect])
    command = runs.steps(3, 60, 10, 60.0)
    expected = runs.reference(values, command, "axis")
    found = runs.simulate(values, command, 32, "axis")
    assert runs.worst_error(found, expected, ("position_m", "velocity_m_s")) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.thorough) for seed in range(4, 20))]
)
def test_random_rigs(seed: int) -> None:
    """Sizes, pressures, loads and nuisances drawn over what machines have, two effects on."""
    rng = np.random.default_rng(seed)
    values = typical()
    for name in values:
        if name.startswith(("load.", "fluid.", "cylinder.dead", "valve.rated_flow")):
            values[name] *= rng.uniform(0.5, 2.0)
    values["cylinder.bore_m"] = rng.uniform(0.04, 0.1)
    values["cylinder.rod_m"] = values["cylinder.bore_m"] * rng.uniform(0.3, 0.7)
    values["supply.pressure_pa"] = rng.uniform(7e6, 25e6)
    values["nuisance.flow_exponent"] = rng.uniform(0.47, 0.55)
    for edge in (
        "overlap",
        "overlap_sides",
        "overlap_tank",
        "gain_direction",
        "gain_sides",
        "gain_tank",
    ):
        assert f"nuisance.edge_{edge}" in values
        values[f"nuisance.edge_{edge}"] = rng.uniform(-0.01, 0.004)
    for edge in ("direction", "sides", "tank"):
        assert f"nuisance.edge_rounding_{edge}" in values
        values[f"nuisance.edge_rounding_{edge}"] = rng.uniform(-0.6, 0.6)
    assert "nuisance.edge_closing" in values
    values["nuisance.edge_closing"] = rng.uniform(0.0, 1.0)
    for effect in rng.choice(sorted(EFFECTS.keys() - WITHOUT_RATE), size=2, replace=False):
        for parameter in EFFECTS[effect].parameters:
            size = parameter.typical * rng.uniform(0.5, 1.5)
            values[f"effects.{effect}.{parameter.name}"] = size
    command = runs.steps(seed, 60, 10, 4.0)
    expected = runs.reference(values, command)
    medium, fine = (
        runs.worst_error(runs.simulate(values, command, substeps), expected, HYDRAULIC)
        for substeps in (32, 64)
    )
    assert fine < 1e-3
    # Where both are at rounding or at a kink of friction, there is no rate to see.
    assert fine < medium / 2.0 or fine < 1e-4
