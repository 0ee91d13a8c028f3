# SPDX-License-Identifier: MIT
"""Reads the servo parameters K, omega_n and xi from the estimates over time, and rig values.

Summaries of many runs: medians with confidence intervals, for tables and for JSON.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.rigs import Rig

from .claims import SETTLED, Interval, median_interval
from .comparison import Contender, Outcome, Samples, Setting
from .recursive import Changed

Triple = tuple[float, float, float]  # value, low, high

# Samples between two readings: two readings a second at 50 ms.
EVERY = 10
SIGMAS = 1.959964  # 95 %


@dataclass(frozen=True, eq=False)
class Reading:
    """Physical parameters while the estimator runs; NaN where theta describes no servo."""

    time_s: FloatArray
    """Times of the T readings in seconds, shape (T,)."""
    value: FloatArray
    deviation: FloatArray
    """Values and their standard deviations, shape (T, 3): K in m/(s V), omega_n in rad/s, xi."""
    status: tuple[str, ...]
    """Status of each reading: "ok", or the reason why there are no values."""
    theta: FloatArray
    """Estimated parameters of each reading, shape (T, 6)."""


def read_over_time(
    samples: Samples, setting: Setting, contender: Contender, dt_s: float
) -> Reading:
    """Runs the estimator over a record and reads the servo from theta every ten samples.

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
    """Rig values computed from a reading: value, and lower and upper end of its 95 % interval."""

    velocity_gain: Triple
    """Estimated K in m/(s V)."""
    bulk_modulus_pa: Triple
    """Bulk modulus in Pa from omega_n, with mass, areas and volumes of the rig file."""
    mass_kg: Triple
    """Mass in kg from omega_n, with the bulk modulus, areas and volumes of the rig file."""


def oil_spring(rig: Rig, position_m: float) -> float:
    """Returns A_a^2 / V_a + A_b^2 / V_b at a position: oil stiffness over bulk modulus, in m."""
    v = rig.values
    cap = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    annulus = cap - math.pi / 4.0 * v["cylinder.rod_m"] ** 2
    volume_a = v["cylinder.dead_volume_a_m3"] + cap * position_m
    volume_b = v["cylinder.dead_volume_b_m3"] + annulus * (v["cylinder.stroke_m"] - position_m)
    return cap**2 / volume_a + annulus**2 / volume_b


def read_rig_values(reading: Reading, rig: Rig, position_m: float) -> RigReading | None:
    """Computes bulk modulus and mass from the last valid reading.

    omega_n^2 = beta_e (A_a^2 / V_a + A_b^2 / V_b) / m, the asymmetric form of the paper's
    omega_n (Merritt, Hydraulic Control Systems, Wiley 1967, sec. 6.2). The intervals include only
    the uncertainty of K and omega_n: the values of the rig file count as known. The result is None
    without a valid reading, or for a rig whose plant is not "ehs".
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


TIMES_S = (5.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True)
class RunSummary:
    """Summary of one contender over all runs; times in seconds, errors as shares of |theta|."""

    error_at: dict[float, Interval]
    """Relative error |theta_hat - theta| / |theta|, by time."""
    settled_s: Interval
    """Time until this error stays below 5 %; the length of the record if it never does."""
    never: float
    """Share of the runs that never settle, 0 to 1."""
    spread: Interval
    """Spread of theta over the last quarter of the run, as a share of |theta|."""
    rmse: Interval
    """RMSE of the innovation over the whole run."""
    theta: tuple[float, ...]
    """Medians of the final parameters."""


def summarise(outcome: Outcome, dt_s: float, times_s: tuple[float, ...] = TIMES_S) -> RunSummary:
    """Summarises all runs of an outcome."""
    samples = outcome.error.shape[1]
    settling = outcome.settling(SETTLED)
    return RunSummary(
        error_at={
            t: median_interval(outcome.error[:, min(round(t / dt_s), samples) - 1]) for t in times_s
        },
        settled_s=median_interval(settling * dt_s),
        never=float(np.mean(settling >= samples)),
        spread=median_interval(outcome.spread),
        rmse=median_interval(outcome.rmse),
        theta=tuple(float(value) for value in np.median(outcome.theta, axis=0)),
    )


@dataclass(frozen=True)
class ChangeSummary:
    """Summary of one contender after a change of the plant, and of its reset."""

    without: Interval
    with_reset: Interval
    """Samples after the change until the error stays below 5 %; the rest of the record if it never
    does."""
    never_without: float
    never_with: float
    """Shares of the runs that never settle, 0 to 1."""
    fired: float
    false_alarms: float
    """Shares of the runs in which the reset fired after the change, and before it."""
    delay: Interval | None
    """Samples from the change to the reset, over the runs in which it fired; None if it never
    fired."""


def summarise_change(changed: Changed) -> dict[str, ChangeSummary]:
    """Summarises the runs around a change, by name of the contender."""
    summaries = {}
    for name, (without, with_reset) in changed.outcomes.items():
        left = without.error.shape[1] - changed.at
        settling = [o.settling(SETTLED, changed.at) for o in (without, with_reset)]
        delays = [
            int(times[times >= changed.at][0]) - changed.at
            for times in with_reset.resets
            if (times >= changed.at).any()
        ]
        summaries[name] = ChangeSummary(
            without=median_interval(settling[0]),
            with_reset=median_interval(settling[1]),
            never_without=float(np.mean(settling[0] >= left)),
            never_with=float(np.mean(settling[1] >= left)),
            fired=len(delays) / len(with_reset.resets),
            false_alarms=float(
                np.mean([bool((times < changed.at).any()) for times in with_reset.resets])
            ),
            delay=median_interval(delays) if delays else None,
        )
    return summaries
