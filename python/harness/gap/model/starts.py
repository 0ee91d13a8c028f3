# SPDX-License-Identifier: MIT
"""Start values for the fits of an effect.

The cost has no gradient with respect to an effect that is off. The fits therefore start from sizes
at which the effect is active.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from ehsid.harness.rigs import Rig

Start = Mapping[str, float]


def _sizes(name: str, *values: float) -> tuple[Start, ...]:
    return tuple({name: value} for value in values)


# Start values that are fractions, times or lengths: mostly a small and a large one, a factor of
# about four apart, so that one of them is within a factor of two or three of any relevant size.
_FIXED: Mapping[str, tuple[Start, ...]] = MappingProxyType(
    {
        # Not a multiple of an integration step: the delayed command would jump between two steps,
        # and the sensitivity would be zero.
        "transport_delay": _sizes("delay_s", 0.0021, 0.0083),
        "valve_hysteresis": _sizes("half_width", 0.01, 0.04),
        "valve_lag": (
            {"bandwidth_hz": 30.0, "damping": 0.8},
            {"bandwidth_hz": 100.0, "damping": 0.8},
        ),
        "valve_null_bias": _sizes("offset", 0.01, -0.01),
        "valve_flow_saturation": _sizes("limit", 0.2, 0.6),
        "valve_dead_band": _sizes("overlap", 0.01, 0.04),
        "entrained_air": _sizes("volume_fraction", 0.005, 0.03),
        "sensor_lag": _sizes("time_constant_s", 0.002, 0.01),
        "sensor_backlash": _sizes("half_width_m", 5e-5, 2e-4),
    }
)


def effect_starts(effect: str, rig: Rig) -> tuple[Start, ...]:
    """Returns the start values of an effect at which it is active, by the parameter's own name.

    Forces and flows are in proportion to those of the rig. Quantisation is a property of the sensor
    that is visible in the record itself. It is not fitted and has no start values.

    Raises
    ------
    KeyError
        the effect has no start values.
    """
    if effect in _FIXED:
        return _FIXED[effect]
    v = rig.values
    if rig.plant == "ehs":
        pressure = v["supply.pressure_pa"]
        force = 0.785 * v["cylinder.bore_m"] ** 2 * pressure
        flow = v["valve.rated_flow_m3_s"]
        stroke = v["cylinder.stroke_m"]
    else:
        # The force of an axis at a command of ten volts. The pressure of a linear servo is the one
        # that its full flow would lose.
        force = 10.0 * v.get("axis.force_per_volt", 100.0)
        pressure, flow, stroke = 1e7, 1e-3, 0.3
    weak, strong = 0.01 * force, 0.04 * force
    match effect:
        case "internal_leakage":
            return _sizes("coefficient_m3_s_pa", 0.01 * flow / pressure, 0.1 * flow / pressure)
        case "external_leakage":
            names = ("coefficient_a_m3_s_pa", "coefficient_b_m3_s_pa")
            return tuple(dict.fromkeys(names, share * flow / pressure) for share in (0.01, 0.1))
        case "supply_droop":
            return tuple(
                {
                    "source_resistance_pa_s_m3": share * pressure / flow,
                    # Resistance and capacitance have a time constant of 20 ms.
                    "accumulator_capacitance_m3_pa": 0.02 * flow / (share * pressure),
                }
                for share in (0.05, 0.2)
            )
        case "coulomb_friction":
            return _sizes("force_n", weak, strong)
        case "stribeck_friction":
            return tuple(
                {"coulomb_n": size, "static_n": 1.7 * size, "stribeck_velocity_m_s": 0.02}
                for size in (weak, strong)
            )
        case "load_force":
            return _sizes("force_n", strong, -strong)
        case "load_spring":
            return tuple(
                {"stiffness_n_m": size / stroke, "force_at_mid_stroke_n": 0.0}
                for size in (strong, 4.0 * strong)
            )
    raise KeyError(effect)


# The simpler law that an effect becomes if one of its terms is removed, by id of the effect.
SIMPLER: Mapping[str, str] = MappingProxyType(
    {"stribeck_friction": "coulomb_friction", "load_spring": "load_force"}
)


def shrunk_force(effect: str, values: Mapping[str, float]) -> float:
    """Force of the simpler law, N, from the values, by full name, of the law that contains it."""
    if effect == "stribeck_friction":
        ends = (values[f"effects.{effect}.{name}"] for name in ("coulomb_n", "static_n"))
        return 0.5 * sum(ends)
    return values[f"effects.{effect}.force_at_mid_stroke_n"]


def grown_start(effect: str, force_n: float, rig: Rig) -> Start:
    """Start values of an effect that contains a simpler one, from the fitted force of that one."""
    if effect == "stribeck_friction":
        return {"coulomb_n": force_n, "static_n": 1.5 * force_n, "stribeck_velocity_m_s": 0.02}
    reach = rig.values.get("cylinder.stroke_m", 0.3)
    return {"stiffness_n_m": 0.3 * abs(force_n) / reach, "force_at_mid_stroke_n": force_n}
