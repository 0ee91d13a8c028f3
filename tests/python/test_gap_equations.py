# SPDX-License-Identifier: MIT
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from ehsid.harness.excitation import multisine
from ehsid.harness.gap.equations import equation_shares, equations, residuals
from ehsid.harness.gap.inverse_servo import CAP, FORCE, ROD, SPOOL, SUPPLY, servo_terms
from ehsid.harness.gap.inverse_signals import all_values, measured
from ehsid.harness.gap.suspects import suspects
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.simulation import draw_noise, simulate

DT_S = 1e-3
BENCH = read_rig(Path(__file__).parents[2] / "examples" / "rigs" / "bench.toml").with_values(
    {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
)
RIG = Rig(
    "bench",
    "ehs",
    BENCH.values,
    sensors={
        "position_noise_m": 5e-6,
        "pressure_a_noise_pa": 1e4,
        "pressure_b_noise_pa": 1e4,
        "supply_pressure_noise_pa": 1e4,
    },
)
AXIS = Rig(
    "axis",
    "axis",
    {"axis.mass_kg": 95.0, "axis.viscous_friction_n_s_m": 205.0, "axis.force_per_volt": 35.15},
    sensors={"position_noise_m": 2e-6},
)
WITH_PRESSURES = ("position_m", "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa")
# A rig that differs from what is told by about one deviation each.
OTHER = {
    "fluid.bulk_modulus_pa": 0.9e9,
    "load.viscous_friction_n_s_m": 1200.0,
    "valve.rated_flow_m3_s": 6.8e-4,
    "load.mass_kg": 125.0,
}
EFFECTS: dict[str, dict[str, float]] = {
    "transport_delay": {"delay_s": 0.0043},
    "valve_hysteresis": {"half_width": 0.03},
    "valve_lag": {"bandwidth_hz": 45.0, "damping": 0.8},
    "valve_null_bias": {"offset": 0.03},
    "valve_flow_saturation": {"limit": 0.4},
    "valve_dead_band": {"overlap": 0.03},
    "internal_leakage": {"coefficient_m3_s_pa": 2e-11},
    "external_leakage": {"coefficient_a_m3_s_pa": 2e-11, "coefficient_b_m3_s_pa": 1e-11},
    "entrained_air": {"volume_fraction": 0.02},
    "supply_droop": {
        "source_resistance_pa_s_m3": 3e9,
        "accumulator_capacitance_m3_pa": 1e-11,
    },
    "coulomb_friction": {"force_n": 500.0},
    "stribeck_friction": {"coulomb_n": 400.0, "static_n": 700.0, "stribeck_velocity_m_s": 0.02},
    "load_spring": {"stiffness_n_m": 3e4, "force_at_mid_stroke_n": 300.0},
    "load_force": {"force_n": 1500.0},
    "sensor_backlash": {"half_width_m": 2e-4},
    "sensor_lag": {"time_constant_s": 0.004},
}
# Largest residual, and how many times as much without the effect, where a smoothed position counts.
LOSSY = {
    "coulomb_friction": (0.25, 3.0),
    "stribeck_friction": (0.25, 3.0),
    "sensor_backlash": (0.5, 1.5),
    "sensor_lag": (0.07, 10.0),
}


def full(effect: str) -> dict[str, float]:
    return {f"effects.{effect}.{name}": value for name, value in EFFECTS[effect].items()}


def made(
    values: Mapping[str, float],
    *,
    rig: Rig = RIG,
    columns: tuple[str, ...] = WITH_PRESSURES,
    noisy: bool = True,
    seed: int = 0,
) -> Record:
    rng = np.random.default_rng(seed)
    n = 6000
    command = multisine(n, DT_S, band_hz=(0.5, 15.0), rms=2.0, rng=rng)
    noise = draw_noise(rig, n, rng) if noisy else None
    run = simulate(rig, command, dt_s=DT_S, values=values, substeps=8, noise=noise).record
    return make_record(
        {"time_s": run.time_s, **{c: run.column(c) for c in ("command_v", *columns)}}
    )


def rms(rows: np.ndarray) -> float:
    return float(np.sqrt(np.mean(rows**2)))


@pytest.mark.parametrize("effect", EFFECTS)
def test_equations_hold_for_what_the_simulator_made(effect: str) -> None:
    """With the effect told they are left with next to nothing; without it, with far more."""
    record = made(full(effect), noisy=False)
    signals = measured(record, RIG)
    told = servo_terms(signals, all_values(RIG, full(effect)), "ehs")
    shares = {
        name: rms(np.sum(list(terms.values()), axis=0)) / max(map(rms, terms.values()))
        for name, terms in told.items()
    }
    # At 1 kHz the trapezoidal rule over a spool of 250 Hz errs by some 1e-3. Seals give within 20
    # um, a tenth of what a moving rod does in the 20 ms over which position is smoothed; that
    # smooths what a sensor's lag or play did, too.
    most, least = LOSSY.get(effect, (0.002, 20.0))
    assert max(shares.values()) < most, shares
    untold = residuals([signals], all_values(RIG, {}), "ehs")
    more = {
        name: rms(rows) / rms(np.sum(list(told[name].values()), axis=0))
        for name, rows in untold.items()
    }
    assert max(more.values()) > least, more


def test_noise_alone_leaves_noise() -> None:
    for share in equation_shares([made(OTHER)], RIG, {}):
        # What the regression cannot take and the linear spool between samples: some per cent.
        assert 0.8 * share.noise < share.residual.value < 1.35 * share.noise, share
        assert share.residual.low <= share.residual.value <= share.residual.high


def test_equations_are_those_that_are_measured() -> None:
    names = [share.equation for share in equation_shares([made({})], RIG, {})]
    assert sorted(names) == sorted([CAP, ROD, SUPPLY, FORCE])
    with_spool = made({}, columns=(*WITH_PRESSURES, "spool"))
    assert SPOOL in [share.equation for share in equation_shares([with_spool], RIG, {})]
    assert equation_shares([made({}, columns=("position_m",))], RIG, {}) == ()
    # One of two records without pressures: nothing in common.
    both = [made({}), made({}, columns=("position_m",))]
    assert equation_shares(both, RIG, {}) == ()


@pytest.mark.parametrize(
    ("effect", "equation"),
    [
        ("coulomb_friction", {FORCE}),
        ("load_force", {FORCE}),
        ("valve_dead_band", {CAP, ROD}),
        ("internal_leakage", {CAP, ROD}),
        ("supply_droop", {SUPPLY}),
    ],
)
def test_only_the_equation_of_an_effect_is_left_with_more(effect: str, equation: set[str]) -> None:
    shares = equation_shares([made({**OTHER, **full(effect)})], RIG, {})
    loud = {share.equation for share in shares if share.residual.low > 1.5 * share.noise}
    assert loud == equation


def suspected(record: Record, rig: Rig = RIG) -> list[tuple[str, Mapping[str, float], float]]:
    found = equations([record], rig, {})
    ranked = suspects(found, [measured(record, rig)], rig, all_values(rig, {}))
    return [(one.effect, one.values, one.gain) for one in ranked]


@pytest.mark.parametrize("effect", sorted(EFFECTS.keys() - {"valve_lag", "sensor_backlash"}))
def test_the_effect_that_was_put_in_is_suspected_first(effect: str) -> None:
    ranked = suspected(made({**OTHER, **full(effect)}, seed=3))
    # Friction with and without its rise, force with and without its spring: nested twins.
    twins = {
        "coulomb_friction": {"stribeck_friction"},
        "load_force": {"load_spring"},
        "transport_delay": {"valve_lag"},
    }
    first = next(one for one in ranked if one[0] not in twins.get(effect, set()))
    assert first[0] == effect, ranked[:4]
    assert first[2] > 0.1


@pytest.mark.parametrize(
    "effect", ["valve_dead_band", "internal_leakage", "coulomb_friction", "load_force"]
)
def test_sizes_of_suspects_are_good_starts(effect: str) -> None:
    ranked = suspected(made({**OTHER, **full(effect)}, seed=4))
    values = next(values for name, values, _ in ranked if name == effect)
    for name, value in full(effect).items():
        assert values[name] == pytest.approx(value, rel=0.25)


def test_nothing_is_suspected_where_there_is_nothing() -> None:
    for seed in range(3):
        assert all(gain < 0.05 for _, _, gain in suspected(made(OTHER, seed=seed)))


def test_an_axis_has_a_force_balance_from_its_position() -> None:
    values = {"effects.coulomb_friction.force_n": 20.0, "effects.load_force.force_n": 5.0}
    record = made(values, rig=AXIS, columns=("position_m",))
    (share,) = equation_shares([record], AXIS, {})
    assert (share.equation, share.subsystem) == (FORCE, "mechanics")
    assert share.residual.low > 2.0 * share.noise
    assert suspected(record, AXIS)[0][0] in ("coulomb_friction", "stribeck_friction")
    (quiet,) = equation_shares([made({}, rig=AXIS, columns=("position_m",))], AXIS, {})
    assert quiet.residual.value < 1.35 * quiet.noise


def test_units_of_the_command_change_nothing() -> None:
    record = made(OTHER)
    shares = equation_shares([record], RIG, {})
    columns = {"time_s": record.time_s, **record.columns}
    tenfold = make_record({**columns, "command_v": 10.0 * record.column("command_v")})
    scaled = RIG.with_values({"valve.rated_command_v": 10.0 * RIG.values["valve.rated_command_v"]})
    for one, other in zip(shares, equation_shares([tenfold], scaled, {}), strict=True):
        assert one.residual.value == pytest.approx(other.residual.value, rel=1e-9)


def test_gaps_are_refused() -> None:
    record = made({})
    time_s = np.array(record.time_s)
    time_s[3000:] += 0.5
    torn = make_record({"time_s": time_s, **record.columns})
    with pytest.raises(ValueError, match="cut the record at its gaps"):
        equation_shares([torn], RIG, {})
