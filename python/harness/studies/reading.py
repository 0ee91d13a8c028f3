# SPDX-License-Identifier: MIT
"""What the estimates say of the servo: K, omega_n and xi over time, and the rig behind them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.rigs import Rig
from ehsid.harness.studies.comparison import Contender, Samples, Setting

Triple = tuple[float, float, float]  # value, low, high

# Between two readings, samples: twice a second at 50 ms.
EVERY = 10
SIGMAS = 1.959964  # 95 %


@dataclass(frozen=True, eq=False)
class Reading:
    """Physical parameters while the estimator runs; NaN where theta has no such counterpart.

    Attributes
    ----------
    time_s
        shape (T,).
    value, deviation
        shape (T, 3): K in m/(s V), omega_n in rad/s, xi.
    status
        of each reading, e.g. "ok" or why there is none.
    theta
        shape (T, 6), from which it was read.
    """

    time_s: FloatArray
    value: FloatArray
    deviation: FloatArray
    status: tuple[str, ...]
    theta: FloatArray


def read_over_time(
    samples: Samples, setting: Setting, contender: Contender, dt_s: float
) -> Reading:
    """Run the estimator over a record, and read theta every half second.

    The structure must be that of Eq. (7) for a servo: na = nb = 3, nk = 1.
    """
    u, y = samples
    estimator = setting.estimator(contender)
    times, values, deviations, status, thetas = [], [], [], [], []
    for first in range(0, u.size, EVERY):
        estimator.run(u[first : first + EVERY], y[first : first + EVERY])
        theta = np.array(estimator.theta_hat)[:6]
        reading = ehsid.identify_servo(
            theta,
            np.asarray(estimator.covariance)[:6, :6],
            dt_s,
        )
        times.append(min(first + EVERY, u.size) * dt_s)
        values.append((reading.gain, reading.omega_n, reading.xi))
        deviations.append((reading.gain_std, reading.omega_n_std, reading.xi_std))
        status.append(reading.status.name)
        thetas.append(theta)
    return Reading(
        np.array(times), np.array(values), np.array(deviations), tuple(status), np.array(thetas)
    )


@dataclass(frozen=True)
class RigReading:
    """What the last reading says of the rig; each with its 95 % interval, else None.

    Attributes
    ----------
    velocity_gain
        K found, and that of the rig.
    bulk_modulus_pa
        from omega_n, with mass, areas and volumes as told.
    mass_kg
        from omega_n, with the bulk modulus as told.
    """

    velocity_gain: Triple
    bulk_modulus_pa: Triple
    mass_kg: Triple


def oil_spring(rig: Rig, position_m: float) -> float:
    """Stiffness of the oil over its bulk modulus, m: A_a^2 / V_a + A_b^2 / V_b at a position."""
    v = rig.values
    cap = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    annulus = cap - math.pi / 4.0 * v["cylinder.rod_m"] ** 2
    volume_a = v["cylinder.dead_volume_a_m3"] + cap * position_m
    volume_b = v["cylinder.dead_volume_b_m3"] + annulus * (v["cylinder.stroke_m"] - position_m)
    return cap**2 / volume_a + annulus**2 / volume_b


def read_rig_values(reading: Reading, rig: Rig, position_m: float) -> RigReading | None:
    """Bulk modulus and mass behind the last reading that is one; None if there is none.

    omega_n^2 = beta_e (A_a^2 / V_a + A_b^2 / V_b) / m, the asymmetric form of the paper's
    omega_n (Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.2). Intervals of K and omega_n
    only: mass, areas and volumes count as known.
    """
    good = [i for i, status in enumerate(reading.status) if status == "ok"]
    if not good or rig.plant != "ehs":
        return None
    gain, omega_n, _ = reading.value[good[-1]]
    gain_std, omega_std, _ = reading.deviation[good[-1]]
    spring, mass = oil_spring(rig, position_m), rig.values["load.mass_kg"]
    bulk = rig.values["fluid.bulk_modulus_pa"]
    low, high = max(omega_n - SIGMAS * omega_std, 0.0), omega_n + SIGMAS * omega_std

    return RigReading(
        velocity_gain=(gain, gain - SIGMAS * gain_std, gain + SIGMAS * gain_std),
        bulk_modulus_pa=_triple(lambda w: w**2 * mass / spring, omega_n, low, high),
        mass_kg=_triple(lambda w: bulk * spring / max(w, 1e-12) ** 2, omega_n, high, low),
    )


def _triple(of: Callable[[float], float], *arguments: float) -> Triple:
    value, low, high = (of(argument) for argument in arguments)
    return value, low, high
