# SPDX-License-Identifier: MIT
"""How often `converged` is true while a parameter is more than three deviations off.

Model (16) with a random binary command, noise coloured by 1 + c q^-1, Constant(1), float32 and no
reset. Writes the table of docs/estimator.md: `python benchmarks/converged_map.py`.
"""

from __future__ import annotations

import numpy as np
import scipy.signal

import ehsid

A = np.array([1.0, -2.2390, 1.7820, -0.5427])
B = np.array([0.0, 0.3850, -0.5810, 0.2954])
THETA = np.concatenate((A[1:], B[1:]))
COLOURS = (0.0, -0.15, 0.05, 0.10, 0.15, 0.30, 0.70)
NOISES = (0.003, 0.05, 0.15)
LENGTHS = (400, 1000, 2000, 3000, 5000)
RUNS = 150


def shares(colour: float, noise: float) -> list[float]:
    """Share of the runs at each length that are converged and wrong."""
    wrong = np.zeros(len(LENGTHS))
    at = np.array(LENGTHS) - 1
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        u = rng.choice([-1.0, 1.0], LENGTHS[-1])
        e = scipy.signal.lfilter([1.0, colour], [1.0], noise * rng.normal(size=u.size))
        y = scipy.signal.lfilter(B, A, u) + scipy.signal.lfilter([1.0], A, e)
        estimator = ehsid.ArxEstimator(3, 3, 1, forgetting=ehsid.Constant(1.0), reset=None)
        path = estimator.run(u, y)
        assert path.converged is not None
        off = np.abs(path.theta[at] - THETA) > 3.0 * path.standard_deviation[at]
        wrong += path.converged[at] & off.any(axis=1)
    return list(wrong / RUNS)


def main() -> None:
    """Prints the table in Markdown."""
    print("| c | noise | " + " | ".join(f"{n:,} samples" for n in LENGTHS) + " |")
    print("|---|---|" + "---:|" * len(LENGTHS))
    for colour in COLOURS:
        for noise in NOISES:
            row = " | ".join(f"{100 * share:.0f} %" for share in shares(colour, noise))
            print(f"| {colour:g} | {noise:g} | {row} |")


if __name__ == "__main__":
    main()
