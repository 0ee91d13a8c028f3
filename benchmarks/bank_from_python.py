# SPDX-License-Identifier: MIT
"""Time of a step in `ehsid.EstimatorBank` by policy, orders and threads, and in `ServoBank`.

    python benchmarks/bank_from_python.py

4096 estimators in float32 take 16 stretches of 256 samples, one behind the other; the fastest one
counts. ARX(3, 3, 1) has a kernel of fixed size, ARX(3, 2, 1) takes the one for any orders. The
64 servos are sampled every 10 ms, with a command that stays for half a second.
"""

from __future__ import annotations

import time

import numpy as np
import numpy.typing as npt

import ehsid

ESTIMATORS, SAMPLES, STRETCHES = 4096, 256, 16
AXES, DT_S = 64, 0.01


def records() -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Commands and positions of a third-order servo, one for each estimator."""
    rng = np.random.default_rng(1)
    samples = SAMPLES * STRETCHES
    u = rng.standard_normal((samples, ESTIMATORS), dtype=np.float32)
    y = np.float32(1e-3) * rng.standard_normal((samples, ESTIMATORS), dtype=np.float32)
    for k in range(3, samples):
        y[k] += 1.8 * y[k - 1] - 1.1 * y[k - 2] + 0.25 * y[k - 3] + 0.1 * u[k - 1]
    return u, y


def nanoseconds(bank: ehsid.EstimatorBank, threads: int, data: tuple[npt.NDArray, ...]) -> float:
    """Time of a step of one estimator in the fastest stretch, ns."""
    u, y = data
    best = np.inf
    for first in range(0, u.shape[0], SAMPLES):
        stretch = slice(first, first + SAMPLES)
        start = time.perf_counter()
        bank.run(u[stretch], y[stretch], every=0, threads=threads)
        best = min(best, time.perf_counter() - start)
    return 1e9 * best / (SAMPLES * ESTIMATORS)


def of_servos() -> tuple[float, float]:
    """Time of a sample of one axis in the fastest stretch, ns: by step(), and by run()."""
    rng = np.random.default_rng(1)
    samples = SAMPLES * STRETCHES
    command = np.repeat(rng.uniform(-5.0, 5.0, (samples // 50 + 1, AXES)), 50, axis=0)[:samples]
    velocity, position = np.zeros(AXES), np.zeros((samples, AXES))
    for k in range(1, samples):
        velocity += 0.2 * (0.03 * command[k - 1] - velocity)
        position[k] = position[k - 1] + DT_S * velocity
    position += rng.normal(0.0, 5e-6, position.shape)
    best = []
    for by_step in (True, False):
        bank = ehsid.ServoBank(DT_S, AXES)
        took = []
        for first in range(0, samples, SAMPLES):
            u, y = (each[first : first + SAMPLES] for each in (command, position))
            start = time.perf_counter()
            if by_step:
                for k in range(SAMPLES):
                    bank.step(u[k], y[k])
            else:
                bank.run(u, y)
            took.append(time.perf_counter() - start)
        best.append(1e9 * min(took) / (SAMPLES * AXES))
    return best[0], best[1]


def main() -> None:
    """Prints a line for each case."""
    print("ServoBank, {} axes: step {:.0f} ns, run {:.0f} ns".format(AXES, *of_servos()))
    data = records()
    print(f"{'policy':12} {'orders':10} {'instructions':13} threads  ns a step  steps a second")
    for policy in (ehsid.Constant, ehsid.FRatio):
        for orders in ((3, 3, 1), (3, 2, 1)):
            for threads in (1, 2):
                bank = ehsid.EstimatorBank(
                    [ehsid.ArxEstimator(*orders, forgetting=policy()) for _ in range(ESTIMATORS)]
                )
                took = nanoseconds(bank, threads, data)
                print(
                    f"{policy.__name__:12} {orders!s:10} {bank.instructions:13} {threads:7d} "
                    f"{took:10.1f} {1e9 / took:15.2e}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
