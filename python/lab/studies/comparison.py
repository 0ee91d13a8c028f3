# SPDX-License-Identifier: MIT
"""Compares forgetting policies on the same records: error, settling time, spread.

An ARX plant whose parameters are known and may change during the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter, lfiltic

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.models.identification import ArxOrders


@dataclass(frozen=True, eq=False)
class KnownPlant:
    """Difference equation (7), A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), constant in pieces."""

    orders: ArxOrders
    """Structure of the model, without constant term."""
    pieces: tuple[tuple[int, FloatArray], ...]
    """Pairs (k, theta): from sample k on the parameters are theta = (a1 .. a_na, b1 .. b_nb). The
    first piece starts at 0, the others follow in order."""

    @classmethod
    def of(cls, orders: ArxOrders, theta: Sequence[float]) -> KnownPlant:
        """Returns a plant whose parameters do not change."""
        return cls(orders, ((0, np.asarray(theta, dtype=np.float64)),))

    def changed(self, at: int, theta: FloatArray) -> KnownPlant:
        """Returns this plant with other parameters from sample `at` on."""
        return KnownPlant(self.orders, (*self.pieces, (at, theta)))

    def theta_path(self, n: int) -> FloatArray:
        """Returns the true parameters at each of n samples, shape (n, na + nb)."""
        starts = np.array([start for start, _ in self.pieces])
        which = np.searchsorted(starts, np.arange(n), side="right") - 1
        return np.stack([theta for _, theta in self.pieces])[which]

    def respond(self, u: FloatArray, e: FloatArray) -> FloatArray:
        """Simulates the output from rest; input u, equation error e and output have shape (N,)."""
        na, nk = self.orders.na, self.orders.nk
        y = np.zeros(u.size)
        stops = [start for start, _ in self.pieces[1:]] + [u.size]
        for (start, theta), stop in zip(self.pieces, stops, strict=True):
            moving = np.convolve(u, np.concatenate([np.zeros(nk), theta[na:]]))[start:stop]
            denominator = np.concatenate([[1.0], theta[:na]])
            # The filter starts from the past outputs, also if other parameters produced them.
            past = y[max(start - na, 0) : start][::-1]
            state = lfiltic([1.0], denominator, past)
            y[start:stop], _ = lfilter([1.0], denominator, moving + e[start:stop], zi=state)
        return y


Samples = tuple[FloatArray, FloatArray]


GUARDED = ehsid.RlsOptions()
PLAIN = ehsid.RlsOptions(information_margin=0.0, covariance_ceiling=1e30)


@dataclass(frozen=True)
class Contender:
    """One configuration of the estimator in the comparison."""

    forgetting: ehsid.Forgetting
    """Forgetting policy."""
    reset: bool = False
    """Whether to restart lambda and P if the RMSE shows a change of the plant."""
    options: ehsid.RlsOptions = GUARDED
    """Guards against wind-up; `PLAIN` is Eqs. (12)-(14) and nothing else."""


@dataclass(frozen=True)
class Setting:
    """Settings that all contenders share."""

    orders: ArxOrders
    """Orders of the ARX model."""
    p0: float = 1e6
    """Initial covariance P(0) = p0 I of the scaled parameters in units of sigma^2, > 0."""
    command_scale: float = 1.0
    position_scale: float = 1.0
    command_offset: float = 0.0
    position_offset: float = 0.0
    """Scaling of the signals, as in `ehsid.Scaling`."""
    dtype: str = "float32"
    """Floating-point type of the estimator."""

    def weights(self) -> FloatArray:
        """Returns the factors from parameters in signal units to scaled ones, shape (n,).

        The factor is 1 for the a, and command scale over position scale for the b. The constant
        term follows the working point and is not compared: its factor is zero.
        """
        gain = self.command_scale / self.position_scale
        ones = np.ones(self.orders.na)
        offset = np.zeros(int(self.orders.offset))
        return np.concatenate([ones, np.full(self.orders.nb, gain), offset])

    def estimator(self, contender: Contender) -> ehsid.ArxEstimator:
        """Returns the estimator of a contender in its initial state."""
        return ehsid.ArxEstimator(
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
            variance0=[self.p0] * self.weights().size,
            dtype=self.dtype,
        )


@dataclass(frozen=True, eq=False)
class Outcome:
    """Results of one contender over all runs."""

    error: FloatArray
    """Shape (runs, N), relative error |theta_hat - theta| / |theta| of the scaled parameters after
    each sample."""
    spread: FloatArray
    """Shape (runs,), spread of the scaled theta_hat over the last quarter of the run: square root
    of the sum of its variances, divided by |theta|."""
    theta: FloatArray
    """Shape (runs, n), final estimates."""
    rmse: FloatArray
    """Shape (runs,), RMSE of the innovation over the whole run, from the first estimate on."""
    forgetting_factor: FloatArray
    """Shape (N,), forgetting factor of the first run; NaN at samples without an estimate."""
    theta_path: FloatArray
    """Shape (N, n), estimates of the first run."""
    resets: tuple[npt.NDArray[np.int64], ...]
    """Samples at which the reset fired, for each run."""

    def settling(self, tolerance: float, start: int = 0) -> npt.NDArray[np.int64]:
        """Returns the settling times of the error in samples, see the function `settling`."""
        return settling(self.error, tolerance, start)


def settling(error: FloatArray, tolerance: float, start: int = 0) -> npt.NDArray[np.int64]:
    """Returns for each run the samples after `start` until the error stays within the tolerance.

    The argument `error` has the shape (runs, N). The result has the shape (runs,) and is N - start
    for a run that does not settle.
    """
    outside = error[:, start:] > tolerance
    n = outside.shape[1]
    last = n - np.argmax(outside[:, ::-1], axis=1)
    return np.where(outside.any(axis=1), last, 0).astype(np.int64)


def joined(parts: Sequence[Outcome]) -> Outcome:
    """Joins the runs of several outcomes of one contender into one outcome."""
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
    """Runs one contender over records of equal length N and compares its estimates with `truth`.

    The true parameters have the shape (N, n).
    """
    weights = setting.weights()
    size = np.linalg.norm(truth * weights, axis=1)
    errors, spreads, thetas, rmses, resets = [], [], [], [], []
    first: tuple[FloatArray, FloatArray] | None = None
    run = ehsid.EstimatorBank([setting.estimator(contender) for _ in records]).run(
        np.column_stack([u for u, _ in records]), np.column_stack([y for _, y in records])
    )
    for i in range(len(records)):
        theta = run.theta[:, i].astype(np.float64)
        innovation = run.innovation[:, i].astype(np.float64)
        errors.append(np.linalg.norm((theta - truth) * weights, axis=1) / size)
        late = theta[-theta.shape[0] // 4 :] * weights
        spreads.append(np.sqrt(late.var(axis=0).sum()) / size[-1])
        thetas.append(theta[-1])
        rmses.append(np.sqrt(np.nanmean(innovation**2)))
        resets.append(np.flatnonzero(run.status[:, i] == ehsid.Status.reset))
        if first is None:
            factor = run.forgetting_factor[:, i].astype(np.float64)
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
    """Simulates the input and output of a known plant, with one record for each seed.

    The argument `noise` is the standard deviation of the white equation error e(k).
    """
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
    """Runs every contender over the same records of a known plant, from the same start.

    Parameters
    ----------
    plant
        plant with the true parameters.
    contenders
        configurations of the estimator by name.
    excite
        function that generates the input of one run, shape (N,).
    noise
        standard deviation of the equation error e(k), white and normal.
    seeds
        random seeds, one run for each.
    setting
        start, scaling and precision; by default `Setting(plant.orders)`, a vague start in float32.
    """
    records = known_records(plant, excite, noise, seeds)
    truth = plant.theta_path(records[0][0].size)
    setting = setting or Setting(plant.orders)
    return {
        name: run_contender(contender, records, truth, setting)
        for name, contender in contenders.items()
    }
