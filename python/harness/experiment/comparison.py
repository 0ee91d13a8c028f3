# SPDX-License-Identifier: MIT
"""Several ways to forget on the same data of a known plant: how close, how fast, how calm."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.experiment.known_plant import KnownPlant

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Contender:
    """One setting of the estimator.

    Attributes
    ----------
    forgetting
        the policy.
    reset
        restart lambda and P where the RMSE shows a change of the plant.
    """

    forgetting: ehsid.Forgetting
    reset: bool = False


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one contender made of all runs.

    Attributes
    ----------
    error
        shape (runs, N), |theta_hat - theta| / |theta| after each sample.
    theta
        shape (runs, n), at the end.
    rmse
        shape (runs,), of the innovation over the whole run, from the first estimate on.
    forgetting_factor
        shape (N,), of the first run; NaN where nothing was estimated.
    theta_path
        shape (N, n), of the first run.
    resets
        for each run the samples at which the reset fired.
    """

    error: FloatArray
    theta: FloatArray
    rmse: FloatArray
    forgetting_factor: FloatArray
    theta_path: FloatArray
    resets: tuple[npt.NDArray[np.int64], ...]

    def settling(self, tolerance: float, start: int = 0) -> npt.NDArray[np.int64]:
        """For each run, samples after `start` until the error is within tolerance for good.

        N - start where it never is.
        """
        outside = self.error[:, start:] > tolerance
        n = outside.shape[1]
        last = n - np.argmax(outside[:, ::-1], axis=1)
        return np.where(outside.any(axis=1), last, 0).astype(np.int64)


def compare(
    plant: KnownPlant,
    contenders: Mapping[str, Contender],
    *,
    excite: Callable[[np.random.Generator], FloatArray],
    noise: float,
    seeds: Iterable[int],
    dtype: str = "float32",
) -> dict[str, Outcome]:
    """Run every contender over the same records, one record a seed, from the same start.

    Parameters
    ----------
    plant
        the truth.
    contenders
        settings by name.
    excite
        makes the input, shape (N,), of one run.
    noise
        standard deviation of the equation error e(k), white and normal.
    seeds
        one run each.
    dtype
        precision of the estimator.
    """
    orders = plant.orders
    records = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        u = excite(rng)
        records.append((u, plant.respond(u, noise * rng.standard_normal(u.size))))
    truth = plant.theta_path(records[0][0].size)
    size = np.linalg.norm(truth, axis=1)

    outcomes = {}
    for name, contender in contenders.items():
        runs = []
        for u, y in records:
            estimator = ehsid.ServoEstimator(
                orders.na,
                orders.nb,
                orders.nk,
                forgetting=contender.forgetting,
                reset=ehsid.RmseResetOptions() if contender.reset else None,
                dtype=dtype,
            )
            runs.append(estimator.run(u, y))
        thetas = np.stack([run.theta.astype(np.float64) for run in runs])
        innovations = np.stack([run.innovation.astype(np.float64) for run in runs])
        outcomes[name] = Outcome(
            error=np.linalg.norm(thetas - truth, axis=2) / size,
            theta=thetas[:, -1],
            rmse=np.sqrt(np.nanmean(innovations**2, axis=1)),
            forgetting_factor=np.where(
                np.isfinite(innovations[0]), runs[0].forgetting_factor.astype(np.float64), np.nan
            ),
            theta_path=thetas[0],
            resets=tuple(np.flatnonzero(run.status == ehsid.Status.reset) for run in runs),
        )
    return outcomes
