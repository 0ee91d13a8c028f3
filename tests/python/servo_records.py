# SPDX-License-Identifier: MIT
"""Records of a simulated servo with one effect or none, for tests of where a gap lies."""

from collections.abc import Mapping

import numpy as np
from sources import ROOT

from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

DT_S = 1e-3
BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml").with_values(
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
    "spool_stiction": {"threshold": 0.05, "rest_s": 0.02},
    "valve_lag": {"bandwidth_hz": 45.0, "damping": 0.8},
    "valve_null_bias": {"offset": 0.03},
    "valve_flow_saturation": {"limit": 0.4},
    "valve_dead_band": {"overlap": 0.03},
    "valve_dead_band_sides": {"overlap_a": 0.05, "overlap_b": 0.02},
    "flow_gain_drift": {"rate_1_s": 0.02},
    "internal_leakage": {"coefficient_m3_s_pa": 2e-11},
    "external_leakage": {"coefficient_a_m3_s_pa": 2e-11, "coefficient_b_m3_s_pa": 1e-11},
    "relief_valve": {"pressure_pa": 7.5e6, "flow_gain_m3_s_pa": 1e-10},
    "counterbalance_valve": {"pressure_pa": 2.2e7, "pilot_ratio": 3.0},
    "entrained_air": {"volume_fraction": 0.05},
    "supply_droop": {
        "source_resistance_pa_s_m3": 3e9,
        "accumulator_capacitance_m3_pa": 1e-11,
    },
    "line_resonance": {"frequency_hz": 12.0, "damping": 0.2, "volume_m3": 5e-3},
    "coulomb_friction": {"force_n": 500.0},
    "coulomb_friction_sides": {"force_extending_n": 700.0, "force_retracting_n": 300.0},
    "position_friction": {"force_n": 500.0, "rise_n_m": 3000.0},
    "stribeck_friction": {"coulomb_n": 400.0, "static_n": 700.0, "stribeck_velocity_m_s": 0.02},
    "load_spring": {"stiffness_n_m": 3e4, "force_at_mid_stroke_n": 300.0},
    "load_force": {"force_n": 1500.0},
    "contact_spring": {"position_m": 0.15, "stiffness_n_m": 1e5},
    "flexible_load": {"mass_share": 0.3, "frequency_hz": 12.0, "damping": 0.1},
    "sensor_backlash": {"half_width_m": 5e-5},
    "sensor_nonlinearity": {"amplitude_m": 5e-4, "period_m": 0.05},
    "sensor_lag": {"time_constant_s": 0.004},
    "position_sensor_delay": {"delay_s": 0.0043},
    "pressure_sensor_gain": {"gain_a": 1.06, "gain_b": 1.0},
    "pressure_sensor_offset": {"offset_a_pa": 5e5, "offset_b_pa": -3e5},
    "pressure_sensor_lag": {"time_constant_s": 0.006},
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
    every: int = 1,
) -> Record:
    """Six seconds of a multisine at 1 kHz; `every` so many samples are kept."""
    rng = np.random.default_rng(seed)
    n = 6000
    command = multisine(n, DT_S, band_hz=(0.5, 15.0), rms=2.0, rng=rng)
    noise = draw_noise(rig, n, rng) if noisy else None
    run = simulate(rig, command, dt_s=DT_S, values=values, substeps=8, noise=noise).record
    return make_record(
        {
            "time_s": run.time_s[::every],
            **{c: run.column(c)[::every] for c in ("command_v", *columns)},
        }
    )
