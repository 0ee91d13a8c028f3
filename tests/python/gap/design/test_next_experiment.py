# SPDX-License-Identifier: MIT
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from ehsid.harness.excitation import multisine
from ehsid.harness.gap import fit
from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.design.menu import MENU, candidate
from ehsid.harness.gap.design.next_experiment import next_experiment, runnable
from ehsid.harness.gap.model.comparison import compare
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.model.separation import (
    Rival,
    Separation,
    contains,
    parameters_of,
    separations,
)
from ehsid.harness.gap.thresholds import SEPARATED_NATS
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.simulation import draw_noise, simulate

pytestmark = pytest.mark.usefixtures("one_process")

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
DT_S = 1e-3
NOISE_M = 6e-6
BENCH = read_rig(RIGS / "bench.toml").with_values(
    {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
)
RIG = Rig("bench", "ehs", BENCH.values, sensors={"position_noise_m": NOISE_M})
FRICTIONLESS = {"effects.coulomb_friction.force_n": 0.0}
FLOORS = {"position_m": NoiseFloor(NOISE_M, 0.9 * NOISE_M, 1.1 * NOISE_M)}
VALUES = {name: floor.value for name, floor in FLOORS.items()}


def rival(effect: str, **values: float) -> Rival:
    return (effect,), {f"effects.{effect}.{name}": value for name, value in values.items()}


DELAY = rival("transport_delay", delay_s=0.004)
# The phase of a lag at low frequency is that of a delay of damping / (pi bandwidth).
LAG = rival("valve_lag", bandwidth_hz=0.8 / np.pi / 0.004, damping=0.8)
LEAKAGE = rival("internal_leakage", coefficient_m3_s_pa=2e-12)
BIAS = rival("valve_null_bias", offset=0.002)
COULOMB = rival("coulomb_friction", force_n=100.0)
DEAD_BAND = rival("valve_dead_band", overlap=0.004)
DROOP = rival("supply_droop", source_resistance_pa_s_m3=1e9, accumulator_capacitance_m3_pa=1e-11)
SATURATION = rival("valve_flow_saturation", limit=0.8)


def problem_of(one: Rival, record: Record) -> tuple[Problem, np.ndarray]:
    parameters, x = parameters_of(RIG, one)
    problem = Problem(
        RIG,
        [compare(record)],
        parameters,
        outputs=("position_m",),
        floors=VALUES,
        fixed=dict(one[1]),
    )
    return problem, x


def simulated(one: Rival, command: np.ndarray, start_m: float, seed: int | None = None) -> Record:
    noise = None
    if seed is not None:
        noise = draw_noise(RIG, command.size, np.random.default_rng(seed))
    return simulate(RIG, command, dt_s=DT_S, values=one[1], position0_m=start_m, noise=noise).record


def refitted(one: Rival, record: Record) -> Rival:
    """The rival with the size that explains a record best."""
    problem, x = problem_of(one, record)
    found = fit(problem, x, iterations=20).x
    values = {p.name: p.value(float(at)) for p, at in zip(problem.parameters, found, strict=True)}
    return one[0], values


@pytest.mark.slow
@pytest.mark.parametrize(
    ("best", "other", "band_hz", "peak_v"),
    [
        (DELAY, LAG, (0.3, 3.0), 0.5),
        (LEAKAGE, BIAS, (0.3, 3.0), 0.2),
        (COULOMB, DEAD_BAND, (0.3, 2.0), 3.0),
        (DROOP, SATURATION, (0.3, 2.0), 1.0),
    ],
)
def test_what_a_smooth_small_record_cannot_tell_apart_the_next_one_does(
    best: Rival, other: Rival, band_hz: tuple[float, float], peak_v: float
) -> None:
    rng = np.random.default_rng(1)
    command = multisine(8000, DT_S, band_hz=band_hz, peak=peak_v, rng=rng)
    smooth = simulated(best, command, 0.15)
    other = refitted(other, smooth)
    (here,) = separations(RIG, [best, other], smooth, VALUES)
    assert here.nats < 0.5 * SEPARATED_NATS
    assert here.power < 0.1

    found = next_experiment(RIG, [best, other], ("position_m",), FLOORS)
    assert found is not None
    assert found.separates == (best[0][0], other[0][0])
    assert found.sensors == ("command_v", "position_m")
    assert found.power > 0.95
    assert set(found.record.columns) == {"command_v", "position_m"}
    assert found.record.dt_s == pytest.approx(DT_S)
    assert np.abs(found.record.column("command_v")).max() <= 10.0

    # Run on the simulator, with noise, it does.
    sent = found.record.column("command_v")
    start = float(found.record.column("position_m")[0])
    run = simulated(best, sent, start, seed=5)
    np.testing.assert_allclose(
        run.column("position_m"), found.record.column("position_m"), atol=6.0 * NOISE_M
    )
    costs = []
    for one in (best, other):
        problem, x = problem_of(one, run)
        costs.append(problem.fit_cost(problem.errors(fit(problem, x, iterations=20).x)))
    assert costs[1] - costs[0] > SEPARATED_NATS


@pytest.mark.slow
def test_a_nested_rival_is_told_by_its_own_record() -> None:
    coulomb = rival("coulomb_friction", force_n=600.0)
    stribeck = rival(
        "stribeck_friction", coulomb_n=550.0, static_n=700.0, stribeck_velocity_m_s=0.02
    )
    # Stribeck friction does all that Coulomb friction does: on a record of that one, nothing is
    # ever between them.
    assert contains(stribeck[0], coulomb[0])
    assert not contains(coulomb[0], stribeck[0])
    found = next_experiment(RIG, [coulomb, stribeck], ("position_m",), FLOORS)
    assert found is not None
    assert found.power > 0.95
    assert "steps" in found.description or "triangle" in found.description


def test_a_record_that_the_best_rival_itself_misses_tells_nothing() -> None:
    command = multisine(4000, DT_S, band_hz=(1.0, 100.0), peak=2.0, rng=np.random.default_rng(0))
    good = simulated(DELAY, command, 0.15)
    (apart,) = separations(RIG, [DELAY, LAG], good, VALUES)
    assert apart.nats > SEPARATED_NATS
    wrong = good.column("position_m") + 1e-3 * np.sin(100.0 * np.arange(4000) * DT_S)
    bad = make_record({"time_s": good.time_s, "command_v": command, "position_m": wrong})
    (found,) = separations(RIG, [DELAY, LAG], bad, VALUES)
    assert (found.nats, found.power) == (0.0, 0.0)


def test_the_order_of_sets_does_not_matter_to_what_contains_what() -> None:
    assert contains(("load_spring", "valve_lag"), ("valve_lag", "load_force"))
    assert contains(("valve_lag",), ())
    assert not contains((), ("valve_lag",))
    assert not contains(("valve_lag",), ("transport_delay",))


def test_no_rivals_no_experiment() -> None:
    assert next_experiment(RIG, [DELAY], ("position_m",), FLOORS) is None
    assert next_experiment(RIG, [], ("position_m",), FLOORS) is None
    # An axis without a stroke or a limit of the command that were told.
    axis = read_rig(RIGS / "axis.toml").with_values(FRICTIONLESS)
    pair = [rival("coulomb_friction", force_n=20.0), rival("load_force", force_n=3.0)]
    assert next_experiment(axis, pair, ("position_m",), FLOORS) is None


def test_a_motor_gets_an_experiment_inside_what_its_records_reached() -> None:
    axis = read_rig(RIGS / "axis.toml").with_values(FRICTIONLESS)
    pair = [rival("coulomb_friction", force_n=20.0), rival("load_force", force_n=3.0)]
    found = next_experiment(
        axis, pair, ("position_m",), FLOORS, command_limit_v=5.0, span_m=(-0.1, 0.15)
    )
    assert found is not None
    assert found.power > 0.95
    assert np.abs(found.record.column("command_v")).max() <= 5.0
    position = found.record.column("position_m")
    assert position.min() > -0.1
    assert position.max() < 0.15


@pytest.mark.parametrize("dt_s", [1e-3, 0.02])
def test_every_entry_of_the_menu_stays_inside_the_limits_or_is_left_out(dt_s: float) -> None:
    made = [candidate(entry, RIG, {}, dt_s=dt_s, limit_v=4.0, span_m=(0.05, 0.2)) for entry in MENU]
    kept = [one for one in made if one is not None]
    assert len(kept) >= len(MENU) - 2
    assert len({one.description for one in kept}) == len(kept)
    for one in kept:
        assert np.abs(one.record.column("command_v")).max() <= 4.0
        position = one.record.column("position_m")
        assert position.min() > 0.05
        assert position.max() < 0.2
        assert "{" not in one.description


def test_a_span_too_small_for_the_drift_leaves_nothing() -> None:
    narrow = [
        candidate(entry, RIG, {}, dt_s=DT_S, limit_v=10.0, span_m=(0.1, 0.1002)) for entry in MENU
    ]
    assert sum(one is not None for one in narrow) < len(MENU)


@pytest.mark.slow
def test_sensors_are_asked_for_where_position_is_too_coarse() -> None:
    inside = rival("internal_leakage", coefficient_m3_s_pa=2e-11)
    outside = rival("external_leakage", coefficient_a_m3_s_pa=2e-11, coefficient_b_m3_s_pa=2e-11)
    coarse = {"position_m": NoiseFloor(5e-3, 5e-3, 5e-3)}
    found = next_experiment(RIG, [inside, outside], ("position_m",), coarse)
    assert found is not None
    assert found.power > 0.95
    assert found.sensors == ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa")


@pytest.mark.usefixtures("two_processes")
def test_a_power_that_is_low_is_said() -> None:
    blind = {"position_m": NoiseFloor(0.1, 0.1, 0.1)}
    axis = read_rig(RIGS / "axis.toml").with_values(FRICTIONLESS)
    pair = [rival("coulomb_friction", force_n=20.0), rival("load_force", force_n=3.0)]
    found = next_experiment(
        axis, pair, ("position_m",), blind, command_limit_v=5.0, span_m=(-0.1, 0.15)
    )
    assert found is not None
    assert found.power < 0.01


def test_values_at_a_bound_are_made_to_run() -> None:
    stribeck = "effects.stribeck_friction"
    found = runnable(
        {
            "effects.valve_dead_band.overlap": float(np.exp(np.log(0.3))) + 1e-15,
            "effects.valve_lag.bandwidth_hz": 0.0,
            f"{stribeck}.static_n": 300.0,
            f"{stribeck}.coulomb_n": 400.0,
        }
    )
    assert found == {
        "effects.valve_dead_band.overlap": 0.3,
        "effects.valve_lag.bandwidth_hz": 0.0,
        f"{stribeck}.static_n": 400.0,
        f"{stribeck}.coulomb_n": 400.0,
    }


@settings(max_examples=50)
@given(nats=st.floats(-100.0, 1000.0), deviation=st.floats(1e-3, 200.0))
def test_power_is_the_chance_of_a_normal_sum(nats: float, deviation: float) -> None:
    power = Separation(nats, deviation).power
    assert power == pytest.approx(1.0 - norm.cdf(SEPARATED_NATS, loc=nats, scale=deviation))
    assert Separation(nats, 0.0).power == float(nats > SEPARATED_NATS)
