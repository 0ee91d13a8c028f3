# SPDX-License-Identifier: MIT
"""Terms of the two continuity equations and of the supply line, from measured pressures.

The equations are those of the simulator: Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5, 6
and 11.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import (
    ATMOSPHERE_PA,
    Measured,
    Terms,
    Values,
    areas,
    true_position,
)
from ehsid.harness.gap.model.inverse_valve import EdgeFlows, edge_flows
from ehsid.harness.gap.model.weak_form import WeakForm
from ehsid.harness.rigs.parameters import EFFECT_PREFIX

POLYTROPIC = 1.3


def supplied(
    signals: Measured, opening: FloatArray, a: FloatArray, b: FloatArray, values: Values
) -> tuple[FloatArray, EdgeFlows]:
    """Returns the supply pressure, Pa, shape (N,), and the flows through the metering edges.

    A supply pressure that is not measured is computed from the equation of the supply line.
    """
    if "supply_pressure_pa" in signals.columns:
        supply = signals.columns["supply_pressure_pa"]
        return supply, edge_flows(opening, a, b, supply, values)
    source = values["supply.pressure_pa"]
    supply = np.full(a.size, source)
    flows = edge_flows(opening, a, b, supply, values)
    resistance, capacitance = _line(values)
    if resistance > 0.0:
        # C dp/dt = (source - p) / R - q, with q at the supply pressure of the iteration before.
        decay = math.exp(-signals.dt_s / (resistance * capacitance))
        for _ in range(3):
            lost = resistance * (flows.supply_a + flows.supply_b)
            supply = source - lfilter([0.0, 1.0 - decay], [1.0, -decay], lost)
            flows = edge_flows(opening, a, b, supply, values)
    return supply, flows


def _line(values: Values) -> tuple[float, float]:
    prefix = f"{EFFECT_PREFIX}supply_droop."
    return (
        values[f"{prefix}source_resistance_pa_s_m3"],
        values[f"{prefix}accumulator_capacitance_m3_pa"],
    )


def supply_line(supply: FloatArray, flows: EdgeFlows, values: Values, weak: WeakForm) -> Terms:
    """Terms of the supply line in weak form, Pa: 0 = p_s - source + R (q + C p_s')."""
    resistance, capacitance = _line(values)
    return {
        "supply": weak.mean(supply),
        "source": np.full(weak.mean(supply).size, -values["supply.pressure_pa"]),
        "drawn": resistance * weak.mean(flows.supply_a + flows.supply_b),
        "stored": resistance * capacitance * weak.slope(supply),
    }


def continuities(
    signals: Measured,
    flows: EdgeFlows,
    a: FloatArray,
    b: FloatArray,
    values: Values,
    weak: WeakForm,
) -> tuple[Terms, Terms]:
    """Terms of the continuity equations of the chambers A and B in weak form, m^3/s.

        0 = V (q / V - (ln V)' - p' / beta_e(p))

    After division by the volume all terms but the flow are derivatives of functions of one measured
    signal. Multiplied by the volume at the middle of the test function they are flows again.
    """
    area_a, area_b = areas(values)
    position = true_position(signals, values)
    volume_a = values["cylinder.dead_volume_a_m3"] + area_a * position
    volume_b = values["cylinder.dead_volume_b_m3"] + area_b * (
        values["cylinder.stroke_m"] - position
    )
    tank = values["supply.tank_pressure_pa"]
    inner = values["effects.internal_leakage.coefficient_m3_s_pa"] * (a - b)
    outer = "effects.external_leakage.coefficient_"
    sides = (
        (flows.supply_a, flows.a_tank, inner + values[f"{outer}a_m3_s_pa"] * (a - tank), a),
        (flows.supply_b, flows.b_tank, values[f"{outer}b_m3_s_pa"] * (b - tank) - inner, b),
    )
    found = []
    for volume, (filling, draining, leaking, pressure) in zip(
        (volume_a, volume_b), sides, strict=True
    ):
        middle = volume[weak.centres(volume.size)]
        found.append(
            {
                "filling": middle * weak.mean(filling / volume),
                "draining": -middle * weak.mean(draining / volume),
                "swept": -middle * weak.slope(np.log(volume)),
                "compressed": -middle * weak.slope(strain(pressure, values)),
                "leaking": -middle * weak.mean(leaking / volume),
            }
        )
    return found[0], found[1]


def strain(pressure: FloatArray, values: Values) -> FloatArray:
    """Volumetric strain, the integral of dp / beta_e(p), up to a constant; no unit, shape (N,)."""
    beta = values["fluid.bulk_modulus_pa"]
    free = values["nuisance.free_gas"] * ATMOSPHERE_PA
    alpha = values["effects.entrained_air.volume_fraction"]
    # Free gas: beta_e q / V = (1 + alpha beta p_0 / p^2) p'.
    found = pressure / beta - free / pressure
    if alpha == 0.0:
        return found
    grid = np.geomspace(0.99 * float(pressure.min()), 1.01 * float(pressure.max()), 2000)
    air = alpha * (ATMOSPHERE_PA / grid) ** (1.0 / POLYTROPIC)
    softer = (1.0 + air * beta / (POLYTROPIC * grid)) / (1.0 + air) - 1.0
    softer *= 1.0 / beta + free / grid**2
    added = np.interp(pressure, grid, cumulative_trapezoid(softer, grid, initial=0))
    return np.asarray(found + added)
