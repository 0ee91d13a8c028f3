# SPDX-License-Identifier: MIT
"""ServoEstimator on one ordinary servo in 72 conditions: python benchmarks/servo_conditions.py

K 0.03 m/s per V, 25 rad/s, xi 0.3, in a P loop with steps of +-20 mm; after 30 of 60 s K rises by
half. Sampling of 1 to 50 ms, sensor noise of 0.5 to 20 um, a sensor with and without steps of 1 um,
a fixed gain of the loop and one that follows K while K is trusted. A condition is right where K is
trusted and within 5 % both before the change and at the end. Tells how long it takes after the
change until K stays within 5 %, and until it is trusted for a second. Exits with 1 if one is wrong.
"""

from __future__ import annotations

import sys
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

import ehsid

GAIN, OMEGA_N, XI, CHANGED = 0.03, 25.0, 0.3, 1.5
SECONDS, CHANGE_S, STEP_S, STEP_M, BANDWIDTH = 60.0, 30.0, 0.6, 0.02, 4.0
DT_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)
NOISE_M = (0.5e-6, 5e-6, 20e-6)
RESOLUTION_M = (0.0, 1e-6)
FIRST_SEED = 7000
MOST_WRONG = 0.05
FloatArray = npt.NDArray[np.float64]


def transition(gain: float, dt_s: float) -> FloatArray:
    """Returns what position, velocity, acceleration and a held command become in one sample."""
    rate = np.zeros((4, 4))
    rate[0, 1] = rate[1, 2] = 1.0
    rate[2, 1:] = -(OMEGA_N**2), -2.0 * XI * OMEGA_N, gain * OMEGA_N**2
    return np.asarray(expm(rate * dt_s))


def followed(
    dt_s: float, noise_m: float, resolution_m: float, follows: bool, seed: int
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Returns the relative error of K and whether K is trusted, at each sample."""
    random = np.random.default_rng(seed)
    count, change = round(SECONDS / dt_s), round(CHANGE_S / dt_s)
    advance = transition(GAIN, dt_s), transition(CHANGED * GAIN, dt_s)
    estimator, state = ehsid.ServoEstimator(dt_s), np.zeros(4)
    kp = 60.0 if follows else BANDWIDTH / GAIN
    error, trusted = np.zeros(count), np.zeros(count, dtype=bool)
    for k in range(count):
        position = state[0] + random.normal(0.0, noise_m)
        if resolution_m > 0.0:
            position = resolution_m * np.rint(position / resolution_m)
        target = STEP_M if k * dt_s % (2.0 * STEP_S) < STEP_S else -STEP_M
        state[3] = np.clip(kp * (target - position), -10.0, 10.0)
        estimator.step(state[3], position)
        gain = estimator.servo().gain
        if follows and gain.trusted:
            kp += 0.01 * (BANDWIDTH / gain.value - kp)
        true = GAIN if k < change else CHANGED * GAIN
        error[k], trusted[k] = gain.value / true - 1.0, gain.trusted
        state = advance[k >= change] @ state
    return error, trusted


def seconds_after(
    error: FloatArray, trusted: npt.NDArray[np.bool_], dt_s: float
) -> tuple[float, float]:
    """Returns when K stays within 5 %, and when it is trusted for a second, after the change."""
    wrong = np.flatnonzero(~(np.abs(error) < MOST_WRONG))
    stays = (wrong[-1] + 1) * dt_s if wrong.size else 0.0
    # The trust of before the change does not count: it ends with the first sample without it.
    doubted = np.flatnonzero(~trusted)
    if not doubted.size:
        return stays, 0.0
    sums = np.concatenate(([0], np.cumsum(trusted)))
    window = round(1.0 / dt_s)
    full = np.flatnonzero(sums[window:] - sums[:-window] == window)
    full = full[full > doubted[0]]
    return stays, full[0] * dt_s if full.size else np.inf


def main() -> int:
    """Runs all conditions, prints a line for each and how many are right."""
    right, times = 0, []
    conditions = list(product(DT_S, NOISE_M, RESOLUTION_M, (False, True)))
    for seed, condition in enumerate(conditions, start=FIRST_SEED):
        dt_s, noise_m, resolution_m, follows = condition
        error, trusted = followed(*condition, seed)
        change = round(CHANGE_S / dt_s)
        ends = [change - 1, error.size - 1]
        good = bool(np.all((np.abs(error[ends]) < MOST_WRONG) & trusted[ends]))
        right += good
        times.append(seconds_after(error[change:], trusted[change:], dt_s))
        print(
            f"{1e3 * dt_s:4.0f} ms, {1e6 * noise_m:4.1f} um, steps of {1e6 * resolution_m:.0f} um, "
            f"{'K followed' if follows else 'fixed gain'}: K off by {100.0 * error[ends[0]]:+.2f} "
            f"and {100.0 * error[ends[1]]:+.2f} %, stays after {times[-1][0]:.2f} s, trusted after "
            f"{times[-1][1]:.2f} s, {'right' if good else 'WRONG'}",
            flush=True,
        )
    print(f"{right} of {len(conditions)} are right; after the change, median, 9 of 10, worst:")
    for name, column in zip(
        ("stays within 5 %", "trusted again"), np.transpose(times), strict=True
    ):
        print(f"{name}: " + ", ".join(f"{x:.1f} s" for x in np.quantile(column, (0.5, 0.9, 1.0))))
    return 0 if right == len(conditions) else 1


if __name__ == "__main__":
    sys.exit(main())
