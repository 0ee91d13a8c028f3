# SPDX-License-Identifier: MIT
"""Sizes at which an effect is tried against residuals, as columns of a regression."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.starts import effect_starts
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import EFFECT_PREFIX

# Sizes of what is not in proportion to its parameter, a factor of two apart; in between the factor
# of the column does well enough to rank.
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
# Several columns, each with a factor of its own: the parameters that an effect is linear in.
_COLUMNS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "external_leakage": ("coefficient_a_m3_s_pa", "coefficient_b_m3_s_pa"),
        "load_spring": ("stiffness_n_m", "force_at_mid_stroke_n"),
    }
)
_BESIDE: Mapping[str, Mapping[str, float]] = MappingProxyType({"valve_lag": {"damping": 0.8}})
# Power by which a size goes with the factor of its column where it is not in proportion: a limit L
# takes x^3 / (3 L^2), a lag 2 zeta / w.
_POWERS: Mapping[str, float] = MappingProxyType({"limit": -0.5, "bandwidth_hz": -1.0})
# What says how, not how much.
_CONSTANTS = ("stribeck_velocity_m_s", "damping", "accumulator_capacitance_m3_pa")
_STRIBECK_SPEEDS = (0.005, 0.02, 0.08)


def full_names(effect: str, parameters: Mapping[str, float]) -> dict[str, float]:
    """The same by full name."""
    return {f"{EFFECT_PREFIX}{effect}.{name}": value for name, value in parameters.items()}


def candidates(effect: str, rig: Rig) -> list[list[dict[str, float]]]:
    """Trials of an effect: each a list of columns, a column a set of parameters."""
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
        # A property of the sensor that is in the floor.
        return []
    if effect in _COLUMNS:
        sizes_of = dict(starts[0])
        # What starts from nothing, a force at mid-stroke, as large as the other over 0.1 m.
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
    """The parameters at the factors: sums of those that the effect is linear in."""
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
