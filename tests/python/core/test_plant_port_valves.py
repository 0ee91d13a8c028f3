# SPDX-License-Identifier: MIT
"""Relief and make-up valves at the working ports: steep ones stay stable with few steps."""

import numpy as np
import plant_runs as runs
import pytest

import ehsid

EFFECTS = {effect.id: effect for effect in ehsid.effects()}
PRESSURES = ("pressure_a_pa", "pressure_b_pa")
COMMAND = runs.steps(0, 100, 10, 6.0)


def with_gain(effect: str, gain: float) -> dict[str, float]:
    return runs.with_effect(EFFECTS[effect]) | {f"effects.{effect}.flow_gain_m3_s_pa": gain}


# Steps of 2 ms / 2 are up to 100 times as long as the time constant of a chamber behind the valve.
@pytest.mark.parametrize("gain", [2e-9, 2e-8, 1e-7])
@pytest.mark.parametrize("substeps", [2, 4, 8])
def test_a_steep_relief_valve_holds_the_pressure_and_does_not_chatter(
    gain: float, substeps: int
) -> None:
    values = with_gain("relief_valve", gain)
    found = runs.simulate(values, COMMAND, substeps)
    free = runs.simulate(runs.shows("relief_valve"), COMMAND, substeps)
    cracks_at = values["effects.relief_valve.pressure_pa"]
    assert max(free[name].max() for name in PRESSURES) > cracks_at + 1.5e6
    # All the oil of the valve goes through it: 5e-4 m^3/s over the gain, and a little for a step.
    limit = cracks_at + 5e-4 / gain + 5e4
    assert max(found[name].max() for name in PRESSURES) < limit
    fine = runs.simulate(values, COMMAND, 256)
    for name in PRESSURES:
        error = np.abs(found[name] - fine[name]).max()
        # Away from the valve the step is coarse as well: no more than without it.
        coarse = np.abs(free[name] - runs.simulate(runs.shows(""), COMMAND, 256)[name]).max()
        assert error < 2.0 * coarse


@pytest.mark.parametrize("gain", [2e-8, 2e-7, 1e-6])
@pytest.mark.parametrize("substeps", [2, 4, 8])
def test_a_steep_make_up_valve_fills_the_chamber_and_no_more(gain: float, substeps: int) -> None:
    values = with_gain("makeup_check", gain)
    tank = values["supply.tank_pressure_pa"]
    free = runs.simulate(runs.shows("makeup_check"), COMMAND, substeps)
    found = runs.simulate(values, COMMAND, substeps)
    assert min(free[name].min() for name in PRESSURES) < 0.1 * tank
    assert min(found[name].min() for name in PRESSURES) > 0.7 * tank
    fine = runs.simulate(values, COMMAND, 256)
    for name in PRESSURES:
        # A valve too steep for the steps overshoots by a bar or two, not by its gain.
        assert np.abs(found[name] - fine[name]).max() < 3e5


def test_a_cavity_is_filled_again_through_the_valve() -> None:
    """From where the oil parts: the valve is wide open and closes within a step."""
    values = with_gain("makeup_check", 1e-6) | {"initial.pressure_a_pa": 1e3}
    values |= {"load.mass_kg": 1e6}  # the rod does not follow
    found = runs.simulate(values, np.zeros(20), 2)["pressure_a_pa"]
    cracks_at = values["supply.tank_pressure_pa"] - values["effects.makeup_check.pressure_pa"]
    assert found[0] < 0.3 * cracks_at
    assert found[1:].max() < 10.0 * cracks_at
    assert found[1:].min() > 0.9 * cracks_at


def test_a_make_up_valve_that_opens_at_vacuum_only_is_none() -> None:
    """Sound machines whose chambers reach vacuum fitted best with one that opens 1.4 bar below."""
    machine = ehsid.MachineScale(
        force_n=4e4,
        rated_flow_m3_s=8e-4,
        full_flow_m3_s=8e-4,
        pressure_pa=1.4e7,
        stroke_m=0.3,
        has_valve=True,
    )
    matters = EFFECTS["makeup_check"].matters
    for pressure, is_one in ((3e4, True), (9e4, True), (1.35e5, False)):
        sizes = {"pressure_pa": pressure, "flow_gain_m3_s_pa": 4e-9}
        assert matters(sizes, machine) == is_one
