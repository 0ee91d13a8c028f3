# SPDX-License-Identifier: MIT
"""Openings of the valve and flows through it, from the command and the measured pressures.

The equations are those of the simulator (docs/simulator.md), without its integration: the spool
follows from the command, and the flows follow from the spool and the measured pressures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter, ss2tf

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import (
    Measured,
    Values,
    terms_of,
)


def second_order(held: FloatArray, bandwidth_hz: float, damping: float, dt_s: float) -> FloatArray:
    """Solves x'' + 2 zeta w x' + w^2 x = w^2 u for x at the samples; u is held over each sample."""
    w = 2.0 * math.pi * bandwidth_hz
    system = (
        np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]),
        np.array([[0.0], [w * w]]),
        np.array([[1.0, 0.0]]),
        np.array([[0.0]]),
    )
    a, b, c, d, _ = cont2discrete(system, dt_s)
    numerator, denominator = ss2tf(a, b, c, d)
    return np.asarray(lfilter(numerator[0], denominator, held), dtype=np.float64)


def delayed(held: FloatArray, samples: float) -> FloatArray:
    """Mean of the delayed command over each sample, shape (N,); zero before the first sample."""
    whole = math.floor(samples)
    fraction = samples - whole
    padded = np.concatenate([np.zeros(whole + 1), held])
    delayed_command = padded[1 : held.size + 1] * (1.0 - fraction) + padded[: held.size] * fraction
    return np.asarray(delayed_command, dtype=np.float64)


def spool_of(signals: Measured, values: Values) -> FloatArray:
    """Spool position at the samples, as a fraction of that at rated command, shape (N,)."""
    terms = terms_of(values)
    bandwidth_hz, damping = terms.spool_lag
    if bandwidth_hz == 0.0:
        bandwidth_hz = values["nuisance.spool_bandwidth_hz"]
        damping = values["nuisance.spool_damping"]
    held = terms.command(delayed(signals.command, terms.delay_s / signals.dt_s), signals.dt_s)
    if bandwidth_hz == 0.0:
        # A held command jumps at each sample. Its value there is the mean of both sides.
        return np.asarray(0.5 * (held + np.concatenate([held[:1], held[:-1]])))
    return second_order(held, bandwidth_hz, damping, signals.dt_s)


def opening_of(spool: FloatArray, values: Values) -> FloatArray:
    """Opening of the valve: the spool position with null bias and flow saturation, shape (N,)."""
    return terms_of(values).opening(spool)


@dataclass(frozen=True, eq=False)
class EdgeFlows:
    """Flows through the four metering edges, m^3/s, shape (N,) each.

    A flow is positive from the first to the second place in its name.
    """

    supply_a: FloatArray
    a_tank: FloatArray
    supply_b: FloatArray
    b_tank: FloatArray


def edge_flows(
    opening: FloatArray,
    pressure_a: FloatArray,
    pressure_b: FloatArray,
    supply: FloatArray,
    time_s: FloatArray,
    values: Values,
) -> EdgeFlows:
    """Computes the flows through the metering edges from the opening, the pressures and the time.

        q = K a dp / (dp^2 + dp_l^2)^((1 - e) / 2),  a = (s + sqrt(s^2 + r^2)) / 2

    An edge opens where the spool has moved by more than its overlap. Its flow is laminar at small
    pressure drops.
    Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3 and 5.
    """
    exponent = values["nuisance.flow_exponent"]
    gain = values["valve.rated_flow_m3_s"] / values["valve.rated_pressure_drop_pa"] ** exponent
    laminar = values["nuisance.laminar_pressure_pa"] ** 2
    rounding = values["nuisance.edge_rounding"] ** 2
    terms = terms_of(values)
    extending, retracting = terms.overlap
    gain_now = gain * terms.flow_share(time_s)
    tank = values["supply.tank_pressure_pa"]

    def flow(direction: float, side: float, to_tank: float, drop: FloatArray) -> FloatArray:
        overlap = (
            (extending if direction > 0.0 else retracting)
            + side * values["nuisance.edge_overlap_sides"]
            + to_tank * values["nuisance.edge_overlap_tank"]
        )
        # An edge with positive `way` opens with a positive spool position and extends the rod.
        relative_gain = (
            1.0
            + direction * values["nuisance.edge_gain_direction"]
            + side * values["nuisance.edge_gain_sides"]
            + to_tank * values["nuisance.edge_gain_tank"]
        )
        opened = direction * opening - overlap
        area = 0.5 * relative_gain * (opened + np.sqrt(opened**2 + rounding))
        return np.asarray(gain_now * area * drop * (drop**2 + laminar) ** (0.5 * (exponent - 1.0)))

    return EdgeFlows(
        flow(1.0, 1.0, -1.0, supply - pressure_a),
        flow(-1.0, 1.0, 1.0, pressure_a - tank),
        flow(-1.0, -1.0, -1.0, supply - pressure_b),
        flow(1.0, -1.0, 1.0, pressure_b - tank),
    )
