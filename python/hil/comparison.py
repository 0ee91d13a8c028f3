# SPDX-License-Identifier: MIT
"""Compares the target's estimates with those of the host, bit for bit and on the same data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.firmware.servo import ServoSettings
from ehsid.harness.models.estimation.servo import KEYS, ServoPath, ServoValue

from .run import RunResult

# Results of the estimator that are compared for each sample besides theta_hat, in this order: names
# on the host, and in the answer of the target.
SCALARS = {
    "innovation": "innovation_m",
    "forgetting_factor": "forgetting_factor",
    "residual_variance": "residual_variance_m2",
    "excitation": "excitation",
}
# Of K, omega_n and xi.
UNITS = ("m/s per V", "rad/s", "")
# Status values of samples that gave an innovation.
ESTIMATED = (ehsid.Status.ok, ehsid.Status.no_information, ehsid.Status.reset)


@dataclass(frozen=True, eq=False)
class Replay:
    """Results of the host's estimator over a run of N samples with n parameters."""

    theta: npt.NDArray[np.float32]
    deviation: npt.NDArray[np.float32]
    """Estimates and their standard deviations, shape (N, n), float32, in units of the signals."""
    scalars: npt.NDArray[np.float32]
    """The results named in `SCALARS`, shape (N, 4), float32."""
    status: npt.NDArray[np.uint8]
    """`ehsid.Status` of each sample, shape (N,)."""
    servo: ServoPath | None = None
    """What a ServoEstimator tells; n = 0 then. None for an ARX model."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """Comparison of the target's results with those of the host."""

    replay: Replay
    """Results of the host."""
    theta: npt.NDArray[np.float32]
    """Estimates of the target, shape (N, n)."""
    different: npt.NDArray[np.int64]
    """Numbers of the samples at which any result or the status differs in at least one bit."""
    largest: float
    """Largest |difference| of a parameter, as a share of its largest |value| on the host; 0 if no
    parameter differs. The parameters of a ServoEstimator are K, omega_n, xi and their half widths.
    """
    servo: ServoPath | None = None
    """What the ServoEstimator of the target tells; n = 0 then. None for an ARX model."""

    @property
    def equal(self) -> bool:
        """Whether all results of all samples are equal bit for bit."""
        return self.different.size == 0

    @property
    def sentence(self) -> str:
        """Result of the comparison as a sentence for the user."""
        total = self.replay.status.size
        if self.equal:
            return f"bit for bit the host's, all {total} samples"
        return (
            f"not the host's at {self.different.size} of {total} samples, first at sample "
            f"{self.different[0]}, parameters by up to {self.largest:.2g} of their size: build the "
            "firmware with -ffp-contract=off and the version of this ehsid"
        )


def lost_before(run: RunResult) -> npt.NDArray[np.int64]:
    """Returns how many cycles were lost right before each sample, shape (N,)."""
    return np.diff(run.numbers, prepend=-1) - 1


def replay(
    run: RunResult,
    configuration: EstimatorConfiguration,
    begun: Mapping[int, EstimatorConfiguration] | None = None,
) -> Replay:
    """Runs the host's float32 estimator over a run, with a new one at each sample of `begun`.

    The new one has the settings that stand there. As on the target, the estimator forgets the past
    samples where cycles were lost.
    """
    command_v, position_m = run.command_v, run.position_m
    estimator = configuration.estimator()
    theta = np.empty((command_v.size, estimator.n), dtype=np.float32)
    deviation = np.empty_like(theta)
    scalars = np.empty((command_v.size, len(SCALARS)), dtype=np.float32)
    status = np.empty(command_v.size, dtype=np.uint8)
    anew = {} if begun is None else begun
    numbers, lost = run.numbers.tolist(), lost_before(run)
    for k, (command, position) in enumerate(zip(command_v, position_m, strict=True)):
        if numbers[k] in anew:
            estimator = anew[numbers[k]].estimator()
        elif lost[k]:
            estimator.step(np.nan, np.nan)
        status[k] = estimator.step(command, position)
        theta[k] = estimator.theta_hat
        deviation[k] = estimator.standard_deviation
        scalars[k] = [getattr(estimator, name) for name in SCALARS]
    return Replay(theta, deviation, scalars, status)


def compare(run: RunResult) -> Agreement:
    """Compares the results of the target with those of the host on the same data."""
    if run.plan.configuration.servo is not None:
        return _compare_servo(run, run.plan.configuration.servo)
    configuration = run.plan.configuration.estimator
    # A target that was reset begins with the settings of the plan, whatever was wished before.
    begun = {**run.begun, **dict.fromkeys(run.restarts, configuration)}
    host = replay(run, configuration, begun)
    results = run.arx_results
    theta = np.array([result.theta for result in results], dtype=np.float32)
    scalars = np.array(
        [[getattr(result, name) for name in SCALARS.values()] for result in results],
        dtype=np.float32,
    )
    status = np.array([result.status for result in results], dtype=np.uint8)
    same = (
        (_bits(theta) == _bits(host.theta)).all(axis=1)
        & (_bits(scalars) == _bits(host.scalars)).all(axis=1)
        & (status == host.status)
    )
    return Agreement(host, theta, run.numbers[~same], _largest(theta, host.theta))


def _compare_servo(run: RunResult, settings: ServoSettings) -> Agreement:
    """Compares values, half widths, reasons and status; a target that was reset begins anew."""
    estimator = settings.estimator()
    status = np.empty(len(run.results), dtype=np.uint8)
    told = np.empty((status.size, len(KEYS), 3), dtype=np.float32)
    numbers, lost = run.numbers.tolist(), lost_before(run)
    for k, (command, position) in enumerate(zip(run.command_v, run.position_m, strict=True)):
        if numbers[k] in run.restarts:
            estimator = settings.estimator()
        elif lost[k]:
            estimator.step(np.nan, np.nan)
        status[k] = estimator.step(command, position)
        servo = estimator.servo()
        for i, key in enumerate(KEYS.values()):
            value = getattr(servo, key)
            told[k, i] = value.value, value.half_width, value.reason
    theirs = np.array([result.tracked for result in run.servo_results], dtype=np.float32)
    their_status = np.array([result.status for result in run.results], dtype=np.uint8)
    same = (_bits(theirs) == _bits(told)).all(axis=(1, 2)) & (their_status == status)
    none = np.empty((status.size, 0), dtype=np.float32)
    return Agreement(
        Replay(none, none, none, status, _servo_path(told, status, estimator.delay)),
        none,
        run.numbers[~same],
        _largest(*(x[:, :, :2].reshape(status.size, -1) for x in (theirs, told))),
        _servo_path(theirs, their_status, estimator.delay),
    )


def _servo_path(
    told: npt.NDArray[np.float32], status: npt.NDArray[np.uint8], delay: int
) -> ServoPath:
    """Returns K, omega_n and xi over a run; `told` has value, half width and reason of each."""
    gain, omega_n, xi = (
        ServoValue(
            name,
            unit,
            one[:, 0].astype(np.float64),
            one[:, 1].astype(np.float64),
            one[:, 2] == ehsid.TrustReason.trusted,
            float(np.mean(one[:, 2] == ehsid.TrustReason.trusted)),
            ehsid.TrustReason(int(one[-1, 2])),
        )
        for name, unit, one in zip(KEYS, UNITS, np.moveaxis(told, 1, 0), strict=True)
    )
    return ServoPath(gain, omega_n, xi, delay, int(np.sum(status == ehsid.Status.reset)))


def _largest(ours: npt.NDArray[np.float32], host: npt.NDArray[np.float32]) -> float:
    """Returns the largest difference; none where both have no number yet."""
    double = host.astype(np.float64)
    difference = np.where(np.isnan(ours) & np.isnan(host), 0.0, np.abs(ours - double))
    size = np.maximum(np.abs(np.nan_to_num(double)).max(axis=0), np.finfo(np.float32).tiny)
    return float(np.nan_to_num(difference / size, nan=np.inf).max())


def rmse(run: RunResult) -> float:
    """RMSE of the innovation from the first estimate on, m, as in the paper; NaN without any."""
    errors = [result.innovation_m for result in run.arx_results if result.status in ESTIMATED]
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")


def _bits(numbers: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    return np.ascontiguousarray(numbers).view(np.uint32)
