# SPDX-License-Identifier: MIT
"""The simulator against the hydraulic actuator of exudyn, a multibody code written by others.

docs/evidence/simulator.md says which definitions differ and how they were matched. Ours is of
second order in its step, exudyn's Runge-Kutta method of fourth. Two things are claimed: ours goes
to exudyn's result at its own rate, and is there when extrapolated to step zero (Richardson).

Tolerance of the second, for each output: what one halving of the step changes in exudyn's result,
plus the same in our extrapolated result, plus MODEL. A halving changes at least seven times the
error it leaves (third order or more), so this is a bound with room for higher terms.
"""

from __future__ import annotations

from collections.abc import Mapping

import exudyn_runs
import numpy as np
import plant_runs as runs
import pytest
from exudyn_runs import OUTPUTS, actuator, areas
from plant_reference import ATMOSPHERE, typical

import ehsid

DT = 1e-3  # sampling time of the command, s
SUBSTEPS = (16, 32, 64)  # of ours, a sample
EXUDYN_SUBSTEPS = (20, 40)
# Our edges are rounded and our flow turns laminar, if ever so little: flows differ by a share of
# 1e-12 of full opening and of (1e-3 Pa / drop)^2 / 4, with drops above 1e4 Pa below 1e-14; sums of
# 3e4 steps in double precision by less than 1e-11. MODEL, a share of an output's range, is above.
PLAIN_VALVE = {
    "nuisance.spool_bandwidth_hz": 0.0,
    "nuisance.edge_rounding": 1e-12,
    "nuisance.laminar_pressure_pa": 1e-3,
    "nuisance.free_gas": 0.0,
}
MODEL = 1e-10

SMALL = {"initial.position_m": 0.12, "initial.pressure_a_pa": 4e6}
LARGE = {
    "cylinder.bore_m": 0.2,
    "cylinder.rod_m": 0.14,
    "cylinder.stroke_m": 1.2,
    "cylinder.dead_volume_a_m3": 2e-3,
    "cylinder.dead_volume_b_m3": 3e-3,
    "load.mass_kg": 6000.0,
    "load.viscous_friction_n_s_m": 2e4,
    "valve.rated_flow_m3_s": 5e-3,
    "supply.pressure_pa": 2.1e7,
    "supply.tank_pressure_pa": 5e5,
    "fluid.bulk_modulus_pa": 1.4e9,
    "effects.load_force.force_n": 3e4,
    "effects.load_spring.stiffness_n_m": 2e5,
    "initial.position_m": 0.5,
    "initial.pressure_a_pa": 8e6,
}
RIGS = {"small": typical() | PLAIN_VALVE | SMALL, "large": typical() | PLAIN_VALVE | LARGE}
WALLS = {"small": 0.0, "large": 7e9}  # Pa, see exudyn_runs

TIME = np.arange(501) * DT
OPENINGS = {
    "step": np.where(TIME < 0.02, 0.0, 0.3),
    "reversal": np.select([TIME < 0.02, TIME < 0.25], [0.0, 0.35], -0.25),
    "sine": 0.4 * np.sin(2.0 * np.pi * 5.0 * TIME),
}

Outputs = dict[str, runs.FloatArray]


def in_balance(rig: Mapping[str, float]) -> dict[str, float]:
    """With the pressure on the rod side that keeps the start at rest."""
    area_a, area_b = areas(rig)
    from_middle = rig["initial.position_m"] - rig["cylinder.stroke_m"] / 2.0
    load = rig["effects.load_force.force_n"]
    load += rig["effects.load_spring.stiffness_n_m"] * from_middle
    gauge_a = rig["initial.pressure_a_pa"] - ATMOSPHERE
    gauge_b = (gauge_a * area_a - load) / area_b
    return dict(rig) | {"initial.pressure_b_pa": gauge_b + ATMOSPHERE}


def of_ours(rig: Mapping[str, float], opening: runs.FloatArray, substeps: int) -> Outputs:
    command = opening * rig["valve.rated_command_v"]
    found, _ = ehsid.simulate_plant("ehs", runs.vector(rig), command, dt_s=DT, substeps=substeps)
    return {name: found[0, :, i] for i, name in enumerate(OUTPUTS)}


def at_step_zero(coarse: Outputs, fine: Outputs) -> Outputs:
    """Richardson's extrapolation of a method of second order, the fine step half the coarse."""
    return {name: fine[name] + (fine[name] - coarse[name]) / 3.0 for name in OUTPUTS}


def furthest(one: Outputs, other: Outputs) -> dict[str, float]:
    """Largest difference of each output, as a share of its range."""
    return {name: runs.worst_error(one, other, (name,)) for name in OUTPUTS}


def check_models_are_the_same(rig: Mapping[str, float], found: Outputs) -> None:
    """No end stop, no cavity, pressure drops far from zero: there they do differ."""
    assert found["position_m"].min() > 0.0
    assert found["position_m"].max() < rig["cylinder.stroke_m"]
    for name in ("pressure_a_pa", "pressure_b_pa"):
        assert found[name].min() > rig["supply.tank_pressure_pa"] + 1e4
        assert found[name].max() < rig["supply.pressure_pa"] - 1e4


def check_agreement(rig: Mapping[str, float], opening: runs.FloatArray, walls: float) -> None:
    coarse, medium, fine = (of_ours(rig, opening, n) for n in SUBSTEPS)
    rough, theirs = (
        exudyn_runs.run(rig, actuator(rig, walls), opening, DT, n) for n in EXUDYN_SUBSTEPS
    )
    check_models_are_the_same(rig, theirs)

    far, near, nearest = (furthest(ours, theirs) for ours in (coarse, medium, fine))
    before, ours = at_step_zero(coarse, medium), at_step_zero(medium, fine)
    halved, halved_theirs = furthest(before, ours), furthest(rough, theirs)
    difference = furthest(ours, theirs)
    for output in OUTPUTS:
        # Down to the last step: a difference of models would stop it. Four in the limit; the next
        # term is of relative size (omega h)^2, 1e-3 for the oil spring of the small rig.
        assert far[output] / near[output] == pytest.approx(4.0, rel=0.01)
        assert near[output] / nearest[output] == pytest.approx(4.0, rel=0.01)
        tolerance = halved[output] + halved_theirs[output] + MODEL
        assert difference[output] < tolerance < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("name", RIGS)
def test_same_motion_and_pressures(name: str, opening: str) -> None:
    check_agreement(in_balance(RIGS[name]), OPENINGS[opening], WALLS[name])


@pytest.mark.parametrize("name", RIGS)
def test_same_ringing_from_a_start_out_of_balance(name: str) -> None:
    """The valve shut, the rod thrown: mass, oil spring and damping alone."""
    rig = in_balance(RIGS[name])
    rig["initial.pressure_b_pa"] -= 5e5
    rig["initial.velocity_m_s"] = 0.02
    check_agreement(rig, np.zeros(201), WALLS[name])


@pytest.mark.thorough
@pytest.mark.parametrize("parameter", actuator(RIGS["large"], WALLS["large"]))
def test_a_change_of_a_thousandth_is_seen(parameter: str) -> None:
    """The comparison has power: each term of exudyn's equations matters in it."""
    rig, opening = in_balance(RIGS["large"]), OPENINGS["reversal"]
    ours = at_step_zero(*(of_ours(rig, opening, n) for n in SUBSTEPS[1:]))
    parameters = actuator(rig, WALLS["large"])
    parameters[parameter] *= 1.001
    theirs = exudyn_runs.run(rig, parameters, opening, DT, EXUDYN_SUBSTEPS[1])
    # Ten times the largest tolerance there is above.
    assert max(furthest(ours, theirs).values()) > 1e-5
