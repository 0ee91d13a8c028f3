# SPDX-License-Identifier: MIT
"""Servo linearised about mid-stroke, and the covariance of its position under a disturbance.

The model is that of Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6, with both chambers and
the spool:

    x'' + 2 zeta w x' + w^2 x = w^2 d_valve,            m v' = A_a p_a - A_b p_b - b v + d_force,
    V_a / beta p_a' =  K_q x - K_c p_a - A_a v + d_a,
    V_b / beta p_b' = -K_q x - K_c p_b + A_b v + d_b,   y' = v.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_discrete_lyapunov
from scipy.signal import cont2discrete

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import Values, areas, terms_of

# Steps of the covariance per step of the averaged error.
SUBSTEPS = 4


def linear_servo(
    values: Values, plant: str, opening: float
) -> tuple[FloatArray, Mapping[str, tuple[FloatArray, ...]]]:
    """State matrix with the position as last state, and the disturbance inputs of each subsystem.

    Parameters
    ----------
    values
        all values of the plant by full name.
    plant
        "ehs" or "axis".
    opening
        rms opening of the valve in the record, as a fraction of full opening. It determines the
        damping by the orifices.
    """
    if plant == "axis":
        mass, viscous = values["axis.mass_kg"], values["axis.viscous_friction_n_s_m"]
        state = np.array([[-viscous / mass, 0.0], [1.0, 0.0]])
        return state, {"mechanics": (np.array([1.0, 0.0]),)}
    area_a, area_b = areas(values)
    middle, beta = 0.5 * values["cylinder.stroke_m"], values["fluid.bulk_modulus_pa"]
    stiff_a = beta / (values["cylinder.dead_volume_a_m3"] + area_a * middle)
    stiff_b = beta / (values["cylinder.dead_volume_b_m3"] + area_b * middle)
    flow_factor = values["valve.rated_flow_m3_s"] / math.sqrt(
        values["valve.rated_pressure_drop_pa"]
    )
    drop = 0.5 * values["supply.pressure_pa"]
    # Pressures are in units of this pressure drop, so that the matrix is well scaled.
    gain = flow_factor * math.sqrt(drop) / drop
    loss = 0.5 * flow_factor * opening / math.sqrt(drop)
    bandwidth_hz, damping = terms_of(values).spool_lag
    if bandwidth_hz == 0.0:
        bandwidth_hz = values["nuisance.spool_bandwidth_hz"]
        damping = values["nuisance.spool_damping"]
    w = 2.0 * math.pi * bandwidth_hz
    mass, viscous = values["load.mass_kg"], values["load.viscous_friction_n_s_m"]
    x, x_rate, p_a, p_b, v, y = range(6)
    state = np.zeros((6, 6))
    state[x, x_rate] = w
    state[x_rate, x], state[x_rate, x_rate] = -w, -2.0 * damping * w
    state[p_a, [x, p_a, v]] = stiff_a * gain, -stiff_a * loss, -stiff_a * area_a / drop
    state[p_b, [x, p_b, v]] = -stiff_b * gain, -stiff_b * loss, stiff_b * area_b / drop
    state[v, [p_a, p_b, v]] = area_a * drop / mass, -area_b * drop / mass, -viscous / mass
    state[y, v] = 1.0
    unit = np.eye(6)
    return state, {
        "valve": (unit[x_rate],),
        # These disturbances are flows in units of the flow of the valve.
        "hydraulics": (stiff_a * gain * unit[p_a], stiff_b * gain * unit[p_b]),
        "mechanics": (unit[v],),
    }


def position_covariance(
    state: FloatArray, input_vector: FloatArray, corner_hz: float, dt_s: float, count: int
) -> FloatArray:
    """Covariance of the position at `count` samples after its reset, shape (count, count).

    At the reset the position is exact and all other states have their stationary covariance. The
    disturbance is white noise behind a first-order low-pass filter with the corner frequency
    `corner_hz`. The result is scaled to a mean variance of one.
    """
    order = state.shape[0]
    augmented = np.zeros((order + 1, order + 1))
    augmented[0, 0] = -2.0 * math.pi * corner_hz
    augmented[1:, 0], augmented[1:, 1:] = input_vector, state
    drive = np.zeros((order + 1, 1))
    drive[0, 0] = 1.0
    zeros = np.zeros((order + 1, 1))
    step, noise_input, *_ = cont2discrete(
        (augmented, drive, np.eye(order + 1), zeros), dt_s / SUBSTEPS
    )
    noise = noise_input @ noise_input.T
    p = np.zeros_like(augmented)
    p[:order, :order] = solve_discrete_lyapunov(
        step[:order, :order], noise[:order, :order], method="direct"
    )
    sample_transition = np.linalg.matrix_power(step, SUBSTEPS)
    # Row of the position in many^k for all k, as cov(y_i+k, y_i) = e' many^k P_i e.
    rows = [np.eye(order + 1)[-1]]
    for _ in range(count - 1):
        rows.append(rows[-1] @ sample_transition)
    position_rows = np.array(rows)
    covariance = np.empty((count, count))
    for i in range(count):
        for _ in range(SUBSTEPS):
            p = step @ p @ step.T + noise
        covariance[i, i:] = covariance[i:, i] = position_rows[: count - i] @ p[:, -1]
    return np.asarray(covariance * (count / np.trace(covariance)))
