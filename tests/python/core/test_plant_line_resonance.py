# SPDX-License-Identifier: MIT
"""The pressure line: the supply pressure at the valve rings, also behind a supply that droops."""

import numpy as np
import plant_runs as runs
import pytest

import ehsid

EFFECTS = {effect.id: effect for effect in ehsid.effects()}
ALONE = runs.with_effect(EFFECTS["line_resonance"])
DROOP = {
    name: value
    for name, value in runs.with_effect(EFFECTS["supply_droop"]).items()
    if "supply_droop" in name
}
SUPPLY = ("supply_pressure_pa",)


@pytest.mark.slow
@pytest.mark.parametrize("droop", [False, True])
def test_the_pressure_at_the_valve_is_of_second_order(droop: bool) -> None:
    values = ALONE | DROOP if droop else ALONE
    command = runs.steps(1, 100, 10, 6.0)
    expected = runs.reference(values, command)
    assert np.ptp(expected["supply_pressure_pa"]) > 5e5
    coarse, medium, fine = (
        runs.worst_error(runs.simulate(values, command, substeps), expected, SUPPLY)
        for substeps in (8, 16, 32)
    )
    assert coarse / medium > 3.5
    assert medium / fine > 3.5
    assert fine < 1e-3


def test_a_line_behind_a_droop_loses_the_pressure_of_both() -> None:
    """Steady flow: R q of the line, R = 2 zeta beta / (w V), and that of the source."""
    command = np.full(400, 4.0)
    long = {"cylinder.stroke_m": 1.0, "initial.position_m": 0.3}
    damping = ALONE["effects.line_resonance.damping"]
    turn = 2.0 * np.pi * ALONE["effects.line_resonance.frequency_hz"]
    volume = ALONE["effects.line_resonance.volume_m3"]
    own = 2.0 * damping * ALONE["fluid.bulk_modulus_pa"] / (turn * volume)
    area = 0.25 * np.pi * ALONE["cylinder.bore_m"] ** 2
    for values, resistance in (
        (ALONE, own),
        (ALONE | DROOP, own + DROOP["effects.supply_droop.source_resistance_pa_s_m3"]),
    ):
        found = runs.simulate(values | long, command, 8)
        lost = values["supply.pressure_pa"] - found["supply_pressure_pa"][-1]
        # A little flows through the rounded edges and into the growing chamber.
        assert lost == pytest.approx(resistance * area * found["velocity_m_s"][-1], rel=0.03)


@pytest.mark.parametrize("volume", [1e-6, 1e-4, 1e-2])
def test_one_too_fast_for_the_steps_stays_bounded(volume: float) -> None:
    values = ALONE | {
        "effects.line_resonance.frequency_hz": 500.0,
        "effects.line_resonance.damping": 1e-3,
        "effects.line_resonance.volume_m3": volume,
    }
    command = runs.steps(2, 1000, 10, 6.0)
    found = runs.simulate(values, command, 2)
    assert np.isfinite(found["position_m"]).all()
    assert np.ptp(found["supply_pressure_pa"][500:]) < 4.0 * values["supply.pressure_pa"]


def test_steps_are_recommended_for_its_frequency() -> None:
    dt_s = 0.02
    slow = ehsid.plant_substeps("ehs", runs.vector(runs.shows(""))[0], dt_s)
    own = 3.0 * 2.0 * np.pi * 300.0 * dt_s
    values = ALONE | {"effects.line_resonance.frequency_hz": 300.0}
    assert slow < own
    assert ehsid.plant_substeps("ehs", runs.vector(values)[0], dt_s) == np.ceil(own)
    # A motor has no line.
    axis = [ehsid.plant_substeps("axis", runs.vector(v)[0], dt_s) for v in (values, ALONE)]
    assert axis[0] == axis[1]
