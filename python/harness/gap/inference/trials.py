# SPDX-License-Identifier: MIT
"""Sizes at which an effect is tried against residuals, as regressors (columns)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.starts import effect_starts
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import EFFECT_PREFIX

# Sizes of effects that are not proportional to their parameter, mostly a factor of two apart.
# Between two sizes the factor of the column is accurate enough for a ranking.
SIZES: Mapping[str, tuple[str, tuple[float, ...]]] = MappingProxyType(
    {
        "valve_lag": ("bandwidth_hz", (20.0, 40.0, 80.0)),
        "valve_dead_band": ("overlap", (0.01, 0.02, 0.04, 0.08)),
        "valve_hysteresis": ("half_width", (0.01, 0.02, 0.04, 0.08)),
        "valve_flow_saturation": ("limit", (0.15, 0.3, 0.6, 1.2)),
        "transport_delay": ("delay_s", (0.001, 0.002, 0.004, 0.008)),
        "sensor_backlash": ("half_width_m", (5e-5, 1e-4, 2e-4, 4e-4)),
        "entrained_air": ("volume_fraction", (0.002, 0.01, 0.04)),
        "sensor_lag": ("time_constant_s", (0.002, 0.008)),
        "valve_null_bias": ("offset", (0.01,)),
    }
)
# Effects that are linear in several parameters: each of these has a column and a factor of its own.
_COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "external_leakage": ("coefficient_a_m3_s_pa", "coefficient_b_m3_s_pa"),
        "load_spring": ("stiffness_n_m", "force_at_mid_stroke_n"),
    }
)
_BESIDE: Mapping[str, Mapping[str, float]] = MappingProxyType({"valve_lag": {"damping": 0.8}})
# Sizes that are proportional to a power of the factor of their column: a limit L takes away
# x^3 / (3 L^2), a lag delays by 2 zeta / w.
_POWERS: Mapping[str, float] = MappingProxyType({"limit": -0.5, "bandwidth_hz": -1.0})
# Parameters of the form of an effect, not of its size: a factor does not scale them.
_CONSTANTS = ("stribeck_velocity_m_s", "damping", "accumulator_capacitance_m3_pa")
_STRIBECK_SPEEDS = (0.005, 0.02, 0.08)


def full_names(effect: str, parameters: Mapping[str, float]) -> dict[str, float]:
    """Returns the parameters of an effect by their full names."""
    return {f"{EFFECT_PREFIX}{effect}.{name}": value for name, value in parameters.items()}


def candidates(effect: str, rig: Rig) -> list[list[dict[str, float]]]:
    """Returns the trials of an effect: each a list of columns, each column a set of parameters."""
    if effect in SIZES:
        name, sizes = SIZES[effect]
        return [[{**_BESIDE.get(effect, {}), name: size}] for size in sizes]
    if effect == "stribeck_friction":
        size = effect_starts(effect, rig)[0]["coulomb_n"]
        return [
            [
                {"coulomb_n": size, "static_n": size, "stribeck_velocity_m_s": speed},
                {"coulomb_n": 0.0, "static_n": size, "stribeck_velocity_m_s": speed},
            ]
            for speed in _STRIBECK_SPEEDS
        ]
    try:
        starts = effect_starts(effect, rig)
    except KeyError:
        # Quantisation is a property of the sensor and part of the noise floor: it has no starts.
        return []
    if effect in _COLUMNS:
        sizes_of = dict(starts[0])
        # A size that starts at zero, the force at mid-stroke, is tried with the force of the spring
        # over 0.1 m.
        other = 0.1 * max(sizes_of.values())
        return [
            [
                {**dict.fromkeys(sizes_of, 0.0), name: sizes_of[name] or other}
                for name in _COLUMNS[effect]
            ]
        ]
    if effect == "supply_droop":
        return [[dict(start)] for start in starts]
    return [[dict(starts[0])]]


def scaled(columns: Sequence[Mapping[str, float]], factors: FloatArray) -> dict[str, float]:
    """Returns the parameters at the factors; those that the effect is linear in are summed."""
    found: dict[str, float] = {}
    for column, factor in zip(columns, factors.tolist(), strict=True):
        for name, size in column.items():
            if name in _CONSTANTS:
                found[name] = size
            elif name in _POWERS:
                found[name] = size * factor ** _POWERS[name] if factor > 0.0 else -1.0
            else:
                found[name] = found.get(name, 0.0) + factor * size
    return found
