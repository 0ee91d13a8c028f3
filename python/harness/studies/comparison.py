# SPDX-License-Identifier: MIT
"""Several ways to forget on the same records: how close, how fast, how calm."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification import ArxOrders
from ehsid.harness.studies.known_plant import KnownPlant

Samples = tuple[FloatArray, FloatArray]


GUARDED = ehsid.RlsOptions()
PLAIN = ehsid.RlsOptions(information_margin=0.0, covariance_ceiling=1e30)


@dataclass(frozen=True)
class Contender:
    """One setting of the estimator.

    Attributes
    ----------
    forgetting
        the policy.
    reset
        restart lambda and P where the RMSE shows a change of the plant.
    options
        guards against wind-up; `PLAIN` is Eqs. (12)-(14) and nothing else.
    """

    forgetting: ehsid.Forgetting
    reset: bool = False
    options: ehsid.RlsOptions = GUARDED


@dataclass(frozen=True)
class Setting:
    """What all contenders share.

    Attributes
    ----------
    orders
        of the ARX model.
    p0
        P(0) = p0 I in units of sigma^2, > 0, of the scaled parameters.
    theta0
        start in the units of the signals; zero by default.
    command_scale, position_scale, command_offset, position_offset
        as in `ehsid.Scaling`.
    dtype
        precision of the estimator.
    """

    orders: ArxOrders
    p0: float = 1e6
    theta0: tuple[float, ...] = ()
    command_scale: float = 1.0
    position_scale: float = 1.0
    command_offset: float = 0.0
    position_offset: float = 0.0
    dtype: str = "float32"

    def weights(self) -> FloatArray:
        """From parameters in units of the signals to scaled ones, shape (n,): b u / y.

        The constant term follows the working point and is not judged: its weight is zero.
        """
        gain = self.command_scale / self.position_scale
        ones = np.ones(self.orders.na)
        offset = np.zeros(int(self.orders.offset))
        return np.concatenate([ones, np.full(self.orders.nb, gain), offset])

    def estimator(self, contender: Contender) -> ehsid.ServoEstimator:
        """The estimator at its start."""
        return ehsid.ServoEstimator(
            self.orders.na,
            self.orders.nb,
            self.orders.nk,
            offset=self.orders.offset,
            forgetting=contender.forgetting,
            reset=ehsid.RmseResetOptions() if contender.reset else None,
            rls=contender.options,
            scaling=ehsid.Scaling(
                command_scale=self.command_scale,
                position_scale=self.position_scale,
                command_offset=self.command_offset,
                position_offset=self.position_offset,
            ),
            theta0=self.theta0,
            variance0=[self.p0] * self.weights().size,
            dtype=self.dtype,
        )


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one contender made of all runs.

    Attributes
    ----------
    error
        shape (runs, N), |theta_hat - theta| / |theta| after each sample, of scaled parameters.
    spread
        shape (runs,), of theta_hat over the last quarter: root of its summed variances over
        |theta|.
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
    spread: FloatArray
    theta: FloatArray
    rmse: FloatArray
    forgetting_factor: FloatArray
    theta_path: FloatArray
    resets: tuple[npt.NDArray[np.int64], ...]

    def settling(self, tolerance: float, start: int = 0) -> npt.NDArray[np.int64]:
        """As `settling` of the error."""
        return settling(self.error, tolerance, start)


def settling(error: FloatArray, tolerance: float, start: int = 0) -> npt.NDArray[np.int64]:
    """For each run, samples after `start` until the error is within tolerance for good.

    N - start where it never is. error: shape (runs, N).
    """
    outside = error[:, start:] > tolerance
    n = outside.shape[1]
    last = n - np.argmax(outside[:, ::-1], axis=1)
    return np.where(outside.any(axis=1), last, 0).astype(np.int64)


def joined(parts: Sequence[Outcome]) -> Outcome:
    """Runs of several outcomes of one contender as one."""
    return Outcome(
        error=np.concatenate([part.error for part in parts]),
        spread=np.concatenate([part.spread for part in parts]),
        theta=np.concatenate([part.theta for part in parts]),
        rmse=np.concatenate([part.rmse for part in parts]),
        forgetting_factor=parts[0].forgetting_factor,
        theta_path=parts[0].theta_path,
        resets=tuple(times for part in parts for times in part.resets),
    )


def run_contender(
    contender: Contender, records: Sequence[Samples], truth: FloatArray, setting: Setting
) -> Outcome:
    """One contender over records of equal length N, against parameters of shape (N, n)."""
    weights = setting.weights()
    size = np.linalg.norm(truth * weights, axis=1)
    errors, spreads, thetas, rmses, resets = [], [], [], [], []
    first: tuple[FloatArray, FloatArray] | None = None
    for u, y in records:
        run = setting.estimator(contender).run(u, y)
        theta = run.theta.astype(np.float64)
        innovation = run.innovation.astype(np.float64)
        errors.append(np.linalg.norm((theta - truth) * weights, axis=1) / size)
        late = theta[-theta.shape[0] // 4 :] * weights
        spreads.append(np.sqrt(late.var(axis=0).sum()) / size[-1])
        thetas.append(theta[-1])
        rmses.append(np.sqrt(np.nanmean(innovation**2)))
        resets.append(np.flatnonzero(run.status == ehsid.Status.reset))
        if first is None:
            factor = run.forgetting_factor.astype(np.float64)
            first = np.where(np.isfinite(innovation), factor, np.nan), theta
    assert first is not None
    return Outcome(
        error=np.stack(errors),
        spread=np.array(spreads),
        theta=np.stack(thetas),
        rmse=np.array(rmses),
        forgetting_factor=first[0],
        theta_path=first[1],
        resets=tuple(resets),
    )


def known_records(
    plant: KnownPlant,
    excite: Callable[[np.random.Generator], FloatArray],
    noise: float,
    seeds: Iterable[int],
) -> list[Samples]:
    """Input and output of one run a seed; noise: deviation of the white equation error e(k)."""
    records = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        u = excite(rng)
        records.append((u, plant.respond(u, noise * rng.standard_normal(u.size))))
    return records


def compare(
    plant: KnownPlant,
    contenders: Mapping[str, Contender],
    *,
    excite: Callable[[np.random.Generator], FloatArray],
    noise: float,
    seeds: Iterable[int],
    setting: Setting | None = None,
) -> dict[str, Outcome]:
    """Run every contender over the same records of a known plant, one a seed, from one start.

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
    setting
        start and precision; by default vague, float32.
    """
    records = known_records(plant, excite, noise, seeds)
    truth = plant.theta_path(records[0][0].size)
    setting = setting or Setting(plant.orders)
    return {
        name: run_contender(contender, records, truth, setting)
        for name, contender in contenders.items()
    }
