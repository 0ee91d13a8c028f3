# SPDX-License-Identifier: MIT
"""Error of ServoEstimator over the Cramer-Rao bound, on linear servos that do not change.

Run: python benchmarks/servo_bound.py

The commands of the unchanged runs of linear servos of `servo_machines.py`, seeds FIRST to LAST,
without the single sine, at drift 0 and in float64. The position is made anew, because the error of
the integration there is larger than the bound: Eq. (5) sampled exactly, and white noise. The bound
is that of the same samples with unknown null bias and first state, by differences of this free run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm
from scipy.signal import dlsim
from servo_machines import Run, runs_of

import ehsid

FIRST, LAST, SAMPLES = 3000, 3060, 8000
STEP = 1e-4  # of the logarithms: the error of the differences is 1e-8
FloatArray = npt.NDArray[np.float64]


def free_run(run: Run, at: FloatArray) -> FloatArray:
    """Returns the position of Eq. (5). at: ln K, ln omega_n, ln xi, bias, and the first state."""
    gain, omega_n, xi = np.exp(at[:3])
    dt = run.dt_s
    # Position, velocity and acceleration over a sample and a sample^2, and the command.
    full = np.zeros((4, 4))
    full[0, 1] = full[1, 2] = 1.0
    full[2, 1:] = -((omega_n * dt) ** 2), -2.0 * xi * omega_n * dt, (omega_n * dt) ** 2 * gain * dt
    sampled = expm(full)
    system = (sampled[:3, :3], sampled[:3, 3:], np.eye(1, 3), np.zeros((1, 1)), 1.0)
    command = np.asarray(run.command[:SAMPLES], dtype=np.float64) - at[3]
    return np.asarray(dlsim(system, command[:, None], x0=at[4:])[1][:, 0])


def deviations(run: Run, noise_m: float) -> FloatArray:
    """Returns the bound as deviations of ln K, ln omega_n and ln xi."""
    at = np.array([*np.log(run.truth[0][1:]), 0.0, 0.0, 0.0, 0.0])
    scale = float(np.std(free_run(run, at)))
    steps = np.array([STEP, STEP, STEP, STEP, *3 * [STEP * scale]])
    columns = [
        (free_run(run, at + step) - free_run(run, at - step)) / (2.0 * STEP)
        for step in np.diag(steps)
    ]
    # By QR: the squares of the columns would lose half of the digits.
    triangle = np.linalg.qr(np.array(columns).T / noise_m, mode="r")
    inverse = np.linalg.inv(triangle)
    return np.asarray(np.sqrt(np.sum(inverse**2, axis=1))[:3])


def main() -> None:
    """Prints the medians of error over bound."""
    ratios = []
    for seed in range(FIRST, LAST, 2):
        run = next(one for one in runs_of(seed) if one.kind == "none")
        if run.command_kind == "loop_sine":
            continue
        true = free_run(run, np.array([*np.log(run.truth[0][1:]), 0.0, 0.0, 0.0, 0.0]))
        noise_m = 5e-6
        noise = np.random.default_rng(seed).normal(0.0, noise_m, true.size)
        estimator = ehsid.ServoEstimator(run.dt_s, drift=0.0, dtype="float64")
        estimator.run(run.command[:SAMPLES], true + noise)
        told = estimator.servo()
        found = np.array([told.gain.value, told.omega_n.value, told.xi.value])
        ratios.append(np.abs(np.log(found / run.truth[0][1:])) / deviations(run, noise_m))
    middle, most = np.median(ratios, axis=0), np.quantile(ratios, 0.9, axis=0)
    print(f"seeds {FIRST} to {LAST - 1}: {len(ratios)} linear servos")
    print("| error over the bound | K | omega_n | xi |\n|---|---|---|---|")
    for name, row in (("median", middle), ("90 % of the servos", most)):
        print(f"| {name} | " + " | ".join(f"{one:.2g}" for one in row) + " |")


if __name__ == "__main__":
    main()
