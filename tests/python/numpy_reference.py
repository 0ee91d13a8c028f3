# SPDX-License-Identifier: MIT
"""The estimator written anew with full matrices, from the papers: what the compiled one must equal.

Recursion: Ghazali et al. 2011, Eqs. (12)-(14). Each policy follows the form its paper prints, and
so differs from the compiled code in form: no factors, no sums kept up to date.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """P and gain behind a sample, the factor it was weighted with, and the forgetting around it."""

    P: FloatArray
    gain: FloatArray
    before: float = 1.0
    after: float = 1.0


class Policy(Protocol):
    """One step of the covariance; `variance` is sigma^2 so far, None while nothing is known."""

    def step(
        self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None
    ) -> Step: ...

    def loss(self, P: FloatArray) -> float:
        """Growth of log det P a step and direction that the policy brings about."""
        ...


def divided(P: FloatArray, phi: FloatArray, factor: float) -> Step:
    """Eq. (13) as printed, and P(k) phi(k) of Eq. (14)."""
    n = phi.size
    s = phi @ P @ phi
    after = (1.0 / factor) * P @ (np.eye(n) - np.outer(phi, phi @ P) / (factor + s))
    return Step(after, after @ phi, before=factor)


@dataclass
class Constant:
    factor: float

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        return divided(P, phi, self.factor)

    def loss(self, P: FloatArray) -> float:
        return 1.0 - self.factor


@dataclass
class Exponential:
    """Eq. (15) solved: 1 - lambda(k) = lambda0^k (1 - lambda(0)).

    Not stepped as printed: in floating point lambda = lambda0 lambda + (1 - lambda0) comes to rest
    up to 5e-15 short of one, which over 1e5 samples is 3e-10 of P.
    """

    factor0: float
    initial: float
    k: int = 0

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        self.k += 1
        return divided(P, phi, 1.0 - self.factor0**self.k * (1.0 - self.initial))

    def loss(self, P: FloatArray) -> float:
        return self.factor0 ** (self.k + 1) * (1.0 - self.initial)


@dataclass
class ErrorDriven:
    """Fortescue, Kershenbaum, Ydstie 1981: gain, forgetting factor, then P, in this order.

    sigma0^2 as given, or where it is 0 the estimator's own residual variance (error_driven.hpp).
    """

    memory: float
    least: float
    noise_variance: float = 0.0

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        sigma2 = self.noise_variance if self.noise_variance > 0.0 else variance
        K = P @ phi / (1.0 + phi @ P @ phi)
        factor = 1.0
        if sigma2:
            factor = 1.0 - (1.0 - phi @ K) * epsilon**2 / (sigma2 * self.memory)
            factor = max(factor, self.least)
        return Step((np.eye(phi.size) - np.outer(K, phi)) @ P / factor, K, after=factor)

    def loss(self, P: FloatArray) -> float:
        return 1.0 / self.memory


@dataclass
class FRatio:
    """Mohseni, Bernstein 2022: F of the errors in a short and a long window that end now."""

    eta: float
    critical: float
    short: int = 10
    long: int = 100
    errors: list[float] = field(default_factory=list)

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        self.errors = [*self.errors, epsilon][-self.long :]
        factor = 1.0
        if len(self.errors) == self.long:
            squares = np.square(self.errors)
            F = squares[-self.short :].mean() / squares.mean()
            g = np.sqrt(F / self.critical) - 1.0
            factor = 1.0 / (1.0 + self.eta * max(g, 0.0))
        return divided(P, phi, factor)

    def loss(self, P: FloatArray) -> float:
        return 0.0


@dataclass
class Directional:
    """SIFt, Lai and Bernstein, arXiv 2404.10844, in information matrices as the paper has it."""

    factor: float
    epsilon: float

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        R = np.linalg.inv(P)
        along = R @ phi
        kept = R - (1.0 - self.factor) * np.outer(along, along) / (phi @ along)
        after = np.linalg.inv(kept + np.outer(phi, phi))
        after = 0.5 * (after + after.T)
        return Step(after, after @ phi)

    def filters(self, phi: FloatArray) -> bool:
        return float(phi @ phi) < self.epsilon

    def loss(self, P: FloatArray) -> float:
        return 0.0


@dataclass
class RandomWalk:
    """Kalman filter of theta(k+1) = theta(k) + w(k): time update, then measurement update."""

    drift: FloatArray

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, variance: float | None) -> Step:
        ahead = P + np.diag(self.drift)
        K = ahead @ phi / (1.0 + phi @ ahead @ phi)
        left = np.eye(phi.size) - np.outer(K, phi)
        return Step(left @ ahead @ left.T + np.outer(K, K), K)  # Joseph's form

    def loss(self, P: FloatArray) -> float:
        return float(np.trace(np.linalg.solve(P, np.diag(self.drift)))) / self.drift.size


class Reference:
    """Recursive least squares with full matrices, without guards unless `margin` is above zero."""

    def __init__(
        self, theta0: FloatArray, variance0: FloatArray, policy: Policy, margin: float = 0.0
    ) -> None:
        self.theta = np.array(theta0, dtype=np.float64)
        self.variance0 = np.array(variance0, dtype=np.float64)
        self.P = np.diag(self.variance0)
        self.policy = policy
        self.margin = margin
        self.factor = 1.0
        self.epsilon = 0.0
        self.gain = np.zeros(self.theta.size)
        self.squares = 0.0  # weighted sum of epsilon^2 lambda / (lambda + phi' P phi)
        self.weight = 0.0  # sum of the weights
        self.recent = 0.0  # the same squares, averaged over about 16 samples

    @property
    def residual_variance(self) -> float:
        """Weighted residual sum over the degrees of freedom: sum of weights less n, or one."""
        return self.squares / max(self.weight - self.theta.size, 1.0)

    def update(self, phi: FloatArray, y: float) -> bool:
        """False where the sample is left out."""
        n = phi.size
        variance = self.residual_variance if self.weight > n + 1 else None
        self.epsilon = y - phi @ self.theta  # (12)
        policy = copy(self.policy)  # a sample left out must not move the policy on
        s = phi @ self.P @ phi
        step = policy.step(self.P, phi, self.epsilon, variance) if s > 0.0 else None
        if step is None or self._left_out(phi, y, s, step.before, variance):
            return False
        self.policy = policy
        # The mean of epsilon times the residual behind the step is sigma^2, converged or not.
        square = self.epsilon**2 * (1.0 - phi @ step.gain)
        self.P, self.gain = step.P, step.gain
        self.theta = self.theta + step.gain * self.epsilon  # (14)
        self.factor = step.before * step.after
        self.squares = step.after * (step.before * self.squares + square)
        self.weight = step.after * (step.before * self.weight + 1.0)
        return True

    def _left_out(
        self, phi: FloatArray, y: float, s: float, before: float, variance: float | None
    ) -> bool:
        """The policy's own filter, and the rule of RlsOptions::information_margin."""
        self.recent += (self.epsilon**2 * before / (before + s) - self.recent) / 16.0
        if isinstance(self.policy, Directional) and self.policy.filters(phi):
            return True
        if self.margin == 0.0 or variance is None or self.recent > 4.0 * variance:
            return False
        loss = self.policy.loss(self.P)
        if s >= self.margin * loss:
            return False
        # A regressor of full size is taken where the model fails, or where P is on average below
        # that of full excitation by such regressors.
        size = float(phi**2 @ self.variance0)
        power = y**2 + float(phi @ self.theta) ** 2
        average = float(np.mean(np.diag(self.P) / self.variance0))
        if size > 2e6 and (self.recent > 0.03 * power or average * size < self.margin * loss):
            return False
        self._follow_fallen_errors(s, loss, size, power, variance)
        return True

    def _follow_fallen_errors(
        self, s: float, loss: float, size: float, power: float, variance: float
    ) -> None:
        """sigma^2 falls to that of the recent errors; sigma^2 P stays, unless P0 bounds it."""
        predicts = self.recent < 1e-4 * power
        if variance <= 10.0 * self.recent or size <= 25.0 or (predicts and s >= loss):
            return
        fall = min(variance / self.recent, 1.0 / np.mean(np.diag(self.P) / self.variance0))
        if predicts:
            fall = min(fall, self.margin * loss / s)
        if fall > 1.0:
            self.P = self.P * fall
            self.squares /= fall
