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
    filtered,
    terms_of,
    true_position,
)
from ehsid.harness.gap.model.inverse_valve import EdgeFlows, edge_flows
from ehsid.harness.gap.model.weak_form import WeakForm


def supply_and_flows(
    signals: Measured, opening: FloatArray, a: FloatArray, b: FloatArray, values: Values
) -> tuple[FloatArray, EdgeFlows]:
    """Returns the supply pressure, Pa, shape (N,), and the flows through the metering edges.

    A supply pressure that is not measured is computed from the equation of the supply line, but for
    the ringing of a pressure line.
    """
    time_s = np.arange(a.size, dtype=np.float64) * signals.dt_s
    if "supply_pressure_pa" in signals.columns:
        supply = signals.columns["supply_pressure_pa"]
        return supply, edge_flows(opening, a, b, supply, time_s, values)
    source = values["supply.pressure_pa"]
    supply = np.full(a.size, source)
    flows = edge_flows(opening, a, b, supply, time_s, values)
    resistance, capacitance = terms_of(values).supply_line
    if resistance > 0.0:
        # C dp/dt = (source - p) / R - q, with q at the supply pressure of the iteration before.
        decay = math.exp(-signals.dt_s / (resistance * capacitance))
        for _ in range(3):
            pressure_loss = resistance * (flows.supply_a + flows.supply_b)
            supply = source - lfilter([0.0, 1.0 - decay], [1.0, -decay], pressure_loss)
            flows = edge_flows(opening, a, b, supply, time_s, values)
    return supply, flows


def supply_line(
    signals: Measured, supply: FloatArray, flows: EdgeFlows, values: Values, weak: WeakForm
) -> Terms:
    """Terms of the supply line in weak form, Pa: 0 = p_s - source + R (q + C p_s')."""
    resistance, capacitance = terms_of(values).supply_line
    drawn = flows.supply_a + flows.supply_b
    terms = {
        "supply": weak.mean(supply),
        "source": np.full(weak.mean(supply).size, -values["supply.pressure_pa"]),
        "drawn": resistance * weak.mean(drawn),
        "stored": resistance * capacitance * weak.slope(supply),
    }
    frequency_hz, _, volume = terms_of(values).pressure_line
    if frequency_hz * volume > 0.0:
        lost = _lost_by_line(drawn, values, signals.dt_s)
        terms |= {"drawn": weak.mean(lost), "stored": np.zeros(terms["supply"].size)}
    return terms


def _lost_by_line(drawn: FloatArray, values: Values, dt_s: float) -> FloatArray:
    """Pressure that the flow drawn loses in a pressure line that rings, Pa, shape (N,).

    The line has L and R, and C in front of the valve; the source has R_s and C_s. The loss is
    N / D q with N = R_s + (R + L s) (1 + R_s C_s s) and D = 1 + R_s C_s s + C s N. Multiplied by D,
    the equation would lose whatever the measured pressure has at the frequency of the line.
    """
    resistance, capacitance = terms_of(values).supply_line
    frequency_hz, damping, volume = terms_of(values).pressure_line
    w = 2.0 * math.pi * frequency_hz
    softness = volume / values["fluid.bulk_modulus_pa"]
    inertance = 1.0 / (w * w * softness)
    line = np.array([inertance, 2.0 * damping * w * inertance])
    store = np.array([resistance * capacitance, 1.0])
    numerator = np.polyadd(np.array([resistance]), np.polymul(line, store))
    denominator = np.polyadd(store, np.polymul(np.array([softness, 0.0]), numerator))
    steady = float(numerator[-1])
    return steady * filtered(drawn, numerator / steady, denominator, dt_s)


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
    leaking_a, leaking_b = terms_of(values).leakage(a, b, tank)
    sides = (
        (flows.supply_a, flows.a_tank, leaking_a, a),
        (flows.supply_b, flows.b_tank, leaking_b, b),
    )
    chambers = []
    for volume, (filling, draining, leaking, pressure) in zip(
        (volume_a, volume_b), sides, strict=True
    ):
        middle = volume[weak.centres(volume.size)]
        chambers.append(
            {
                "filling": middle * weak.mean(filling / volume),
                "draining": -middle * weak.mean(draining / volume),
                "swept": -middle * weak.slope(np.log(volume)),
                "compressed": -middle * weak.slope(strain(pressure, values)),
                "leaking": -middle * weak.mean(leaking / volume),
            }
        )
    return chambers[0], chambers[1]


def strain(pressure: FloatArray, values: Values) -> FloatArray:
    """Volumetric strain, the integral of dp / beta_e(p), up to a constant; no unit, shape (N,)."""
    beta = values["fluid.bulk_modulus_pa"]
    free_gas = values["nuisance.free_gas"] * ATMOSPHERE_PA
    # Free gas: beta_e q / V = (1 + alpha beta p_0 / p^2) p'.
    basic_strain = pressure / beta - free_gas / pressure
    grid = np.geomspace(0.99 * float(pressure.min()), 1.01 * float(pressure.max()), 2000)
    compliance = beta / terms_of(values).bulk_modulus(beta, grid) - 1.0
    if not np.any(compliance):
        return np.asarray(basic_strain)
    compliance *= 1.0 / beta + free_gas / grid**2
    added_strain = np.interp(pressure, grid, cumulative_trapezoid(compliance, grid, initial=0))
    return np.asarray(basic_strain + added_strain)
