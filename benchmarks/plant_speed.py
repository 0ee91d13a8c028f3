# SPDX-License-Identifier: MIT
"""Speed of the simulator: python benchmarks/plant_speed.py

20 s of a 1 kHz record, the bench of examples/rigs with its valve lag, one thread. Times are the
best and the median of 15 runs; a run with sensitivities is given as a multiple of the plain run of
the same pass.
"""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import random_steps

RIG = Path(__file__).parents[1] / "examples" / "rigs" / "bench.toml"
RUNS = 15


def seconds(values: np.ndarray, command: np.ndarray, substeps: int, varied: list[int]) -> float:
    """One run."""
    start = time.perf_counter()
    ehsid.simulate_plant(
        "ehs", values, command, dt_s=1e-3, substeps=substeps, varied=varied, threads=1
    )
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    values = read_rig(RIG).plant_values()[np.newaxis]
    rng = np.random.default_rng(0)
    command = random_steps(20_000, amplitude=1.0, hold=(50, 500), rng=rng)
    print("substeps  sensitivities  best ms  median ms  ratio (median, spread)  goal n/2")
    for substeps in (2, 4):
        for n in (0, 4, 8, 16):
            pairs = [
                (
                    seconds(values, command, substeps, []),
                    seconds(values, command, substeps, [*range(n)]),
                )
                for _ in range(RUNS)
            ]
            times = [1e3 * pair[1] for pair in pairs]
            ratios = sorted(pair[1] / pair[0] for pair in pairs)
            print(
                f"{substeps:8d}  {n:13d}  {min(times):7.2f}  {statistics.median(times):9.2f}  "
                f"{statistics.median(ratios):6.2f} ({ratios[1]:.2f} .. {ratios[-2]:.2f})  "
                f"{'' if n == 0 else n / 2:>8}"
            )


if __name__ == "__main__":
    main()
