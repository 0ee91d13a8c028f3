# SPDX-License-Identifier: MIT
"""Constants of the generator's machine: floats and tuples of floats, which numba can compile."""

from __future__ import annotations

from typing import NamedTuple

# Widths and weights of the play elements of a hysteresis; unused elements have weight 0.
Plays = tuple[float, float, float, float, float]
NO_PLAYS: Plays = (0.0, 0.0, 0.0, 0.0, 0.0)

Edges = tuple[float, float, float, float]
NO_WEAR: Edges = (0.0, 0.0, 0.0, 0.0)


class Truth(NamedTuple):
    """Constants in the equations of `machine`, SI: pressures absolute, openings as fractions.

    The default of an optional part leaves it out.
    """

    # Motion
    mass_kg: float
    viscous_n_s_m: float
    stroke_m: float
    area_a_m2: float = 0.0
    area_b_m2: float = 0.0
    force_per_unit_n: float = 0.0  # a motor's force at rated command; 0: hydraulics
    # Oil: Murnaghan's law; free gas, its fraction at atmospheric pressure
    dead_volume_a_m3: float = 1.0
    dead_volume_b_m3: float = 1.0
    bulk_modulus_0_pa: float = 1e9  # at zero pressure
    bulk_slope: float = 5.0  # d(bulk modulus)/d(pressure)
    gas_fraction: float = 1e-5
    # Gas that dissolves: its fraction where all of it is free, the pressure from which on none is,
    # and the times in which it goes into solution and comes out of it
    dissolving_gas: float = 0.0
    all_dissolved_pa: float = 1e6
    dissolving_s: float = 1.0
    coming_out_s: float = 1.0
    balance_pa: float = 1e4  # pressure at which `machine.compression` is zero
    # Valve: four edges PA, AT, PB, BT, each with overlap (negative: underlap) and gain
    flow_gain: float = 0.0  # m^3/(s Pa^exponent), full opening
    flow_exponent: float = 0.5
    transition_pa: float = 2e4  # pressure drop below which the flow is laminar
    round_width: float = 1e-3
    overlap_pa: float = 0.0
    overlap_at: float = 0.0
    overlap_pb: float = 0.0
    overlap_bt: float = 0.0
    gain_pa: float = 1.0
    gain_at: float = 1.0
    gain_pb: float = 1.0
    gain_bt: float = 1.0
    null_bias: float = 0.0
    opening_limit: float = 0.0  # 0: none
    limit_power: float = 0.0  # 0: tanh; else x / (1 + |x / limit|^power)^(1 / power)
    amplifier_s: float = 0.0  # first-order lag before the spool; 0: none
    spool_rad_s: float = 2000.0
    spool_damping: float = 0.8
    spool_slew_1_s: float = 1e3
    # Friction of the spool after Dahl: the change of the command that it takes, 0: none, and the
    # way in which it has reversed
    spool_friction: float = 0.0
    spool_friction_way: float = 1.0
    # Wear of the edges PA, AT, PB, BT: further rounding
    worn: Edges = NO_WEAR
    play: float = 0.0  # half-width
    # Prandtl-Ishlinskii hysteresis in place of the play; the first weight is 0: none
    play_half_widths: Plays = NO_PLAYS
    play_weights: Plays = NO_PLAYS
    stick: float = 0.0  # the spool stays until its command changes by more than this
    delay_s: float = 0.0
    # Supply: pump with a linear characteristic, gas accumulator, pressure ripple. With a relief
    # valve, the resistance is that of the valve's characteristic up to the flow of the pump, and
    # that of the pump's slip beyond it.
    source_pa: float = 1e7
    tank_pa: float = 2e5
    source_resistance_pa_s_m3: float = 1e7
    accumulator_m3_pa: float = 1e-10  # at source pressure
    pump_flow_m3_s: float = 0.0  # 0: no relief valve
    slip_resistance_pa_s_m3: float = 1e7
    hum_share: float = 0.0
    hum_hz: float = 100.0
    gain_rate_1_s: float = 0.0  # relative change of the flow through all edges in a second
    # Leakages, laminar; valves at both chambers, to tank above a pressure, from it below
    leak_ab_m3_s_pa: float = 0.0
    leak_a_m3_s_pa: float = 0.0
    leak_b_m3_s_pa: float = 0.0
    relief_pa: float = 1e8
    relief_m3_s_pa: float = 0.0
    makeup_pa: float = 0.0  # below the tank pressure
    makeup_m3_s_pa: float = 0.0
    counterbalance_pa: float = 0.0  # 0: no such valves
    pilot_ratio: float = 0.0
    # Friction: LuGre, or Dahl with an exponent above 0, or Bouc-Wen with a power above 0
    coulomb_n: float = 0.0
    static_n: float = 0.0
    stribeck_m_s: float = 0.01
    bristle_n_m: float = 1e7
    bristle_n_s_m: float = 0.0
    dahl_exponent: float = 0.0
    bouc_wen_power: float = 0.0
    bouc_wen_sigma: float = 1.0  # 0.5: unloading is linear; 1: as after Dahl
    local_share: float = 0.0  # relative increase of friction about one place
    local_at_m: float = 0.0
    local_width_m: float = 1.0
    friction_by_direction: float = 0.0  # relative difference from the mean, of extension
    friction_rise_1_m: float = 0.0  # relative increase from mid-stroke
    # Load; a positive force opposes extension
    load_n: float = 0.0  # at mid-stroke
    spring_n_m: float = 0.0
    contact_n_m: float = 0.0  # something elastic that the rod meets beyond a place
    contact_at_m: float = 0.0
    contact_soft_m: float = 1e-4  # depth within which it is softer
    contact_s_m: float = 0.0  # relative increase of its force with the speed inwards
    # A boom that the cylinder turns, in place of the mass; see `linkage`. 0: none
    boom_kg_m2: float = 0.0  # moment of inertia about its pivot
    boom_n_m: float = 0.0  # moment of its weight where it is level
    boom_level_rad: float = 0.0  # angle of the triangle where it is level
    pivot_m: float = 1.0  # from the boom's pivot to the foot of the cylinder
    lever_m: float = 1.0  # from the boom's pivot to the eye of the rod
    retracted_m: float = 1.0  # from foot to eye at position 0
    second_mass_kg: float = 0.0
    second_spring_n_m: float = 0.0
    second_damper_n_s_m: float = 0.0
    # Warming: relative change of a value long after the start, and the leakage that is then added
    warming_s: float = 10.0
    warming_viscous: float = 0.0
    warming_bulk: float = 0.0
    warming_leak_m3_s_pa: float = 0.0
    heating_k: float = 0.0  # rise of the temperature long after the start, on which all oil depends
    # Laws that no catalogue has; see `unnamed`
    cubic_n_m3: float = 0.0  # spring force over the cube of the distance from mid-stroke
    drag_n_s2_m2: float = 0.0  # force over the square of the speed
    later_load_n: float = 0.0  # force that comes up about a time
    later_at_s: float = 0.0
    later_rise_s: float = 1.0
    knee: float = 0.0  # opening up to which the edges pass less; 0: none
    knee_gain: float = 1.0  # slope up to there; at full opening nothing changes
    bias_rate_1_s: float = 0.0  # drift of the valve's null
    orifice_leak_m3_s_pa05: float = 0.0  # turbulent, from chamber A to tank
    scale_slope: float = 0.0  # reading too large by this share of the distance beyond a place
    scale_at_m: float = 0.0
    delay_rate: float = 0.0  # growth of the delay, s/s
    # Position sensor
    sensor_play_m: float = 0.0
    sensor_lag_s: float = 0.0
    sensor_step_m: float = 1e-6
    scale_wave_m: float = 0.0  # error of the reading, a sine along the stroke
    scale_period_m: float = 1.0
    scale_bow_m: float = 0.0  # error of the reading in the middle of the stroke, none at its ends
    reading_delay_s: float = 0.0
    # Transducers of the chamber pressures
    pressure_gain_a: float = 1.0
    pressure_gain_b: float = 1.0
    pressure_offset_a_pa: float = 0.0
    pressure_offset_b_pa: float = 0.0
    pressure_lag_s: float = 0.0
