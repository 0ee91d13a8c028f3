# SPDX-License-Identifier: MIT
"""Effects of the catalogue: how their sizes are drawn for a machine, and how they change it.

Names and parameters are those of the diagnosis; the equations in which they act are not.

Effects that came into the catalogue after the pools of the drawn effects.

They are put into machines on request only, so that a seed goes on to make the same machine. Names
and parameters are those of the diagnosis; the equations in which they act are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .nominal_rig import NominalRig, spread
from .truth import Truth
from .variants import balance, with_friction

Sizes = Mapping[str, float]


@dataclass(frozen=True)
class Effect:
    """An effect that the generator can put into a machine.

    `draw` draws sizes for a rig file. `put` puts them into a machine; its last argument is the
    deflection of the friction's bristles before they slide, m.
    """

    subsystem: str
    draw: Callable[[np.random.Generator, NominalRig], dict[str, float]]
    put: Callable[[Truth, Sizes, float], Truth]
    axis: bool = False  # it acts on a motor-driven axis, too


# Powers with which parameters follow the size of their effect; 0 is the form of a law. All others
# have 1.
POWERS: Mapping[str, float] = {
    "bandwidth_hz": -1.0,
    "limit": -0.5,
    "damping": 0.0,
    "stribeck_velocity_m_s": 0.0,
    "accumulator_capacitance_m3_pa": 0.0,
    "frequency_hz": 0.0,
    "period_m": 0.0,
    "pressure_pa": 0.0,
    "pilot_ratio": 0.0,
    "position_m": 0.0,
}
# What stands for no effect where that is not zero.
NONE: Mapping[str, float] = {"gain_a": 1.0, "gain_b": 1.0}


def sized(sizes: Sizes, share: float) -> dict[str, float]:
    """Returns sizes of an effect of which this share is left, above 0."""
    none = {name: NONE.get(name, 0.0) for name in sizes}
    # A relief valve that cracks lower does more, a counterbalance valve that opens lower less.
    powers = {**POWERS, "pressure_pa": 1.0 if "pilot_ratio" in sizes else POWERS["pressure_pa"]}
    return {
        name: none[name] + (size - none[name]) * share ** powers.get(name, 1.0)
        for name, size in sizes.items()
    }


def signed(rng: np.random.Generator, low: float, high: float) -> float:
    """Draws a number between low and high, with either sign."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def full_flow(rig: NominalRig) -> float:
    """Flow at full opening and half the pressure difference of supply and tank, m^3/s."""
    v = rig.values
    drop = 0.5 * (v["supply.pressure_pa"] - v["supply.tank_pressure_pa"])
    return v["valve.rated_flow_m3_s"] * math.sqrt(drop / v["valve.rated_pressure_drop_pa"])


def _dead_band(machine: Truth, sizes: Sizes, _: float) -> Truth:
    lap = sizes["overlap"]
    return machine._replace(
        overlap_pa=machine.overlap_pa + lap,
        overlap_at=machine.overlap_at + lap,
        overlap_pb=machine.overlap_pb + lap,
        overlap_bt=machine.overlap_bt + lap,
    )


def _saturation(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(opening_limit=sizes["limit"])


def _external_leakage(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        leak_a_m3_s_pa=sizes["coefficient_a_m3_s_pa"],
        leak_b_m3_s_pa=sizes["coefficient_b_m3_s_pa"],
    )


def _air(machine: Truth, sizes: Sizes, _: float) -> Truth:
    machine = machine._replace(gas_fraction=machine.gas_fraction + sizes["volume_fraction"])
    return machine._replace(balance_pa=balance(machine))


def _droop(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        source_resistance_pa_s_m3=sizes["source_resistance_pa_s_m3"],
        accumulator_m3_pa=sizes["accumulator_capacitance_m3_pa"],
    )


def _draw_droop(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    resistance = rng.uniform(0.1, 0.35) * rig.values["supply.pressure_pa"] / full_flow(rig)
    return {
        "source_resistance_pa_s_m3": float(resistance),
        "accumulator_capacitance_m3_pa": spread(rng, 5e-3, 1e-1) / float(resistance),
    }


def _coulomb(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    return with_friction(machine, sizes["force_n"], sizes["force_n"], 0.02, bristle_m)


def _stribeck(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    return with_friction(
        machine, sizes["coulomb_n"], sizes["static_n"], sizes["stribeck_velocity_m_s"], bristle_m
    )


def _draw_stribeck(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    coulomb = rig.force_n * rng.uniform(0.015, 0.05)
    return {
        "coulomb_n": float(coulomb),
        "static_n": float(coulomb * rng.uniform(1.5, 2.2)),
        "stribeck_velocity_m_s": rig.speed_m_s * spread(rng, 0.02, 0.08),
    }


def _spring(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        spring_n_m=sizes["stiffness_n_m"], load_n=sizes["force_at_mid_stroke_n"]
    )


def _draw_spring(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "stiffness_n_m": rig.force_n * float(rng.uniform(0.06, 0.2)) / (0.5 * rig.stroke_m),
        "force_at_mid_stroke_n": rig.force_n * signed(rng, 0.0, 0.05),
    }


CATALOGUE: Mapping[str, Effect] = {
    "valve_dead_band": Effect(
        "valve", lambda rng, rig: {"overlap": float(rng.uniform(0.02, 0.06))}, _dead_band
    ),
    "valve_hysteresis": Effect(
        "valve",
        lambda rng, rig: {"half_width": float(rng.uniform(0.01, 0.05))},
        lambda machine, sizes, _: machine._replace(play=sizes["half_width"]),
    ),
    "valve_null_bias": Effect(
        "valve",
        lambda rng, rig: {"offset": signed(rng, 0.01, 0.05)},
        lambda machine, sizes, _: machine._replace(null_bias=sizes["offset"]),
    ),
    "valve_lag": Effect(
        "valve",
        lambda rng, rig: {
            "bandwidth_hz": float(rng.uniform(15.0, 40.0)),
            "damping": float(rng.uniform(0.5, 1.0)),
        },
        lambda machine, sizes, _: machine._replace(
            spool_rad_s=2.0 * math.pi * sizes["bandwidth_hz"], spool_damping=sizes["damping"]
        ),
    ),
    "valve_flow_saturation": Effect(
        "valve", lambda rng, rig: {"limit": float(rng.uniform(0.3, 0.8))}, _saturation
    ),
    "internal_leakage": Effect(
        "hydraulics",
        lambda rng, rig: {
            "coefficient_m3_s_pa": spread(rng, 0.15, 0.6)
            * full_flow(rig)
            / rig.values["supply.pressure_pa"]
        },
        lambda machine, sizes, _: machine._replace(leak_ab_m3_s_pa=sizes["coefficient_m3_s_pa"]),
    ),
    "external_leakage": Effect(
        "hydraulics",
        lambda rng, rig: {
            f"coefficient_{side}_m3_s_pa": spread(rng, 0.03, 0.15)
            * full_flow(rig)
            / (0.5 * rig.values["supply.pressure_pa"])
            for side in "ab"
        },
        _external_leakage,
    ),
    "entrained_air": Effect(
        "hydraulics", lambda rng, rig: {"volume_fraction": spread(rng, 0.005, 0.03)}, _air
    ),
    "supply_droop": Effect("hydraulics", _draw_droop, _droop),
    "coulomb_friction": Effect(
        "mechanics",
        lambda rng, rig: {"force_n": rig.force_n * float(rng.uniform(0.02, 0.08))},
        _coulomb,
        axis=True,
    ),
    "stribeck_friction": Effect("mechanics", _draw_stribeck, _stribeck, axis=True),
    "load_spring": Effect("mechanics", _draw_spring, _spring, axis=True),
    "load_force": Effect(
        "mechanics",
        lambda rng, rig: {"force_n": rig.force_n * signed(rng, 0.03, 0.12)},
        lambda machine, sizes, _: machine._replace(load_n=sizes["force_n"]),
        axis=True,
    ),
    "transport_delay": Effect(
        "timing",
        lambda rng, rig: {"delay_s": round(float(rng.uniform(2e-3, 1e-2)), 4)},
        lambda machine, sizes, _: machine._replace(delay_s=sizes["delay_s"]),
        axis=True,
    ),
    "sensor_lag": Effect(
        "sensor",
        lambda rng, rig: {"time_constant_s": float(rng.uniform(2e-3, 1e-2))},
        lambda machine, sizes, _: machine._replace(sensor_lag_s=sizes["time_constant_s"]),
        axis=True,
    ),
    "sensor_quantisation": Effect(
        "sensor",
        lambda rng, rig: {"step_m": float(f"{rig.stroke_m / 0.3 * spread(rng, 5e-5, 2e-4):.2g}")},
        lambda machine, sizes, _: machine._replace(sensor_step_m=sizes["step_m"]),
        axis=True,
    ),
    "sensor_backlash": Effect(
        "sensor",
        lambda rng, rig: {"half_width_m": rig.stroke_m / 0.3 * spread(rng, 5e-5, 3e-4)},
        lambda machine, sizes, _: machine._replace(sensor_play_m=sizes["half_width_m"]),
        axis=True,
    ),
}

# Pairs that are not drawn together: one effect contains the other, or both set the same field.
EXCLUSIVE_PAIRS = (
    frozenset({"coulomb_friction", "stribeck_friction"}),
    frozenset({"load_spring", "load_force"}),
)

# The same for all effects of a kind; of each at most one is drawn where effects are drawn of both
# catalogues.
OF_ONE_KIND = (
    frozenset(
        {"coulomb_friction", "stribeck_friction", "coulomb_friction_sides", "position_friction"}
    ),
    frozenset({"load_spring", "load_force", "contact_spring"}),
    frozenset({"valve_dead_band", "valve_dead_band_sides"}),
)


def excludes(one: str, other: str) -> bool:
    """Whether two effects are of one kind, so that a machine does not get both."""
    return any({one, other} <= kind for kind in OF_ONE_KIND)


BAR_PA = 1e5


def _draw_two_overlaps(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    sides = [float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.0, 0.02))]
    rng.shuffle(sides)
    return {"overlap_a": sides[0], "overlap_b": sides[1]}


def _two_overlaps(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Edges that extend the rod are those from supply to A and from B to tank."""
    return machine._replace(
        overlap_pa=machine.overlap_pa + sizes["overlap_a"],
        overlap_bt=machine.overlap_bt + sizes["overlap_a"],
        overlap_at=machine.overlap_at + sizes["overlap_b"],
        overlap_pb=machine.overlap_pb + sizes["overlap_b"],
    )


def _draw_friction_by_direction(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    mean, difference = rig.force_n * float(rng.uniform(0.03, 0.06)), signed(rng, 0.3, 0.6)
    return {
        "force_extending_n": mean * (1.0 + difference),
        "force_retracting_n": mean * (1.0 - difference),
    }


def _friction_by_direction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    extending, retracting = sizes["force_extending_n"], sizes["force_retracting_n"]
    mean = 0.5 * (extending + retracting)
    return with_friction(machine, mean, mean, 0.02, bristle_m)._replace(
        friction_by_direction=(extending - mean) / mean
    )


def _draw_rising_friction(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    force = rig.force_n * float(rng.uniform(0.03, 0.06))
    return {"force_n": force, "rise_n_m": signed(rng, 0.5, 0.9) * force / (0.5 * rig.stroke_m)}


def _rising_friction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    force = sizes["force_n"]
    return with_friction(machine, force, force, 0.02, bristle_m)._replace(
        friction_rise_1_m=sizes["rise_n_m"] / force
    )


def _draw_flexible_load(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "mass_share": float(rng.uniform(0.3, 0.6)),
        "frequency_hz": float(rng.uniform(4.0, 12.0)),
        "damping": float(rng.uniform(0.02, 0.1)),
    }


def _flexible_load(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Splits the load into two masses; the rig file states the sum of both."""
    mass = sizes["mass_share"] * machine.mass_kg
    natural = 2.0 * math.pi * sizes["frequency_hz"]
    return machine._replace(
        mass_kg=machine.mass_kg - mass,
        second_mass_kg=mass,
        second_spring_n_m=mass * natural**2,
        second_damper_n_s_m=2.0 * sizes["damping"] * mass * natural,
    )


def _draw_gains(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    """One transducer is wrong, the other one is nearly right."""
    gains = [1.0 + signed(rng, 0.05, 0.12), 1.0 + signed(rng, 0.0, 0.004)]
    rng.shuffle(gains)
    return {"gain_a": gains[0], "gain_b": gains[1]}


def _draw_offsets(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    supply = rig.values["supply.pressure_pa"]
    offsets = [supply * signed(rng, 0.04, 0.1), supply * signed(rng, 0.0, 0.003)]
    rng.shuffle(offsets)
    return {"offset_a_pa": offsets[0], "offset_b_pa": offsets[1]}


def _draw_contact(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "position_m": rig.stroke_m * float(rng.uniform(0.45, 0.55)),
        "stiffness_n_m": rig.force_n * float(rng.uniform(0.5, 2.0)) / rig.stroke_m,
    }


def _contact(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        contact_at_m=sizes["position_m"],
        contact_n_m=sizes["stiffness_n_m"],
        contact_soft_m=1e-3 * machine.stroke_m,
        contact_s_m=0.3,
    )


ADDED_EFFECTS: Mapping[str, Effect] = {
    "valve_dead_band_sides": Effect("valve", _draw_two_overlaps, _two_overlaps),
    "flow_gain_drift": Effect(
        "valve",
        lambda rng, rig: {"rate_1_s": signed(rng, 0.006, 0.015)},
        lambda machine, sizes, _: machine._replace(gain_rate_1_s=sizes["rate_1_s"]),
    ),
    "relief_valve": Effect(
        "hydraulics",
        lambda rng, rig: {
            "pressure_pa": float(rng.uniform(0.55, 0.7)) * rig.values["supply.pressure_pa"],
            "flow_gain_m3_s_pa": float(rng.uniform(1.0, 3.0))
            * full_flow(rig)
            / rig.values["supply.pressure_pa"],
        },
        lambda machine, sizes, _: machine._replace(
            relief_pa=sizes["pressure_pa"], relief_m3_s_pa=sizes["flow_gain_m3_s_pa"]
        ),
    ),
    "makeup_check": Effect(
        "hydraulics",
        lambda rng, rig: {
            "pressure_pa": float(rng.uniform(1e4, 5e4)),
            "flow_gain_m3_s_pa": float(rng.uniform(0.3, 0.8)) * full_flow(rig) / BAR_PA,
        },
        lambda machine, sizes, _: machine._replace(
            makeup_pa=sizes["pressure_pa"], makeup_m3_s_pa=sizes["flow_gain_m3_s_pa"]
        ),
    ),
    "coulomb_friction_sides": Effect(
        "mechanics", _draw_friction_by_direction, _friction_by_direction, axis=True
    ),
    "position_friction": Effect("mechanics", _draw_rising_friction, _rising_friction, axis=True),
    "flexible_load": Effect("mechanics", _draw_flexible_load, _flexible_load, axis=True),
    "sensor_nonlinearity": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * signed(rng, 0.002, 0.006),
            "period_m": rig.stroke_m * float(rng.uniform(0.1, 0.3)),
        },
        lambda machine, sizes, _: machine._replace(
            scale_wave_m=sizes["amplitude_m"], scale_period_m=sizes["period_m"]
        ),
        axis=True,
    ),
    "pressure_sensor_gain": Effect(
        "sensor",
        _draw_gains,
        lambda machine, sizes, _: machine._replace(
            pressure_gain_a=sizes["gain_a"], pressure_gain_b=sizes["gain_b"]
        ),
    ),
    "pressure_sensor_offset": Effect(
        "sensor",
        _draw_offsets,
        lambda machine, sizes, _: machine._replace(
            pressure_offset_a_pa=sizes["offset_a_pa"], pressure_offset_b_pa=sizes["offset_b_pa"]
        ),
    ),
    "pressure_sensor_lag": Effect(
        "sensor",
        lambda rng, rig: {"time_constant_s": float(rng.uniform(4e-3, 1.5e-2))},
        lambda machine, sizes, _: machine._replace(pressure_lag_s=sizes["time_constant_s"]),
    ),
    "position_sensor_delay": Effect(
        "sensor",
        lambda rng, rig: {"delay_s": float(rng.uniform(2.5e-3, 1e-2))},
        lambda machine, sizes, _: machine._replace(reading_delay_s=sizes["delay_s"]),
        axis=True,
    ),
    "contact_spring": Effect("mechanics", _draw_contact, _contact),
    "counterbalance_valve": Effect(
        "hydraulics",
        lambda rng, rig: {
            "pressure_pa": float(rng.uniform(1.2, 1.8)) * rig.values["supply.pressure_pa"],
            "pilot_ratio": float(rng.uniform(2.0, 4.0)),
        },
        lambda machine, sizes, _: machine._replace(
            counterbalance_pa=sizes["pressure_pa"], pilot_ratio=sizes["pilot_ratio"]
        ),
    ),
}
