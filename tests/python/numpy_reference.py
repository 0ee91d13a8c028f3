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


ROUNDING = 64.0 * float(np.finfo(np.float64).eps)  # of phi' theta


@dataclass(frozen=True)
class Step:
    """P and gain behind a sample, the factor it was weighted with, and the forgetting around it."""

    P: FloatArray
    gain: FloatArray
    before: float = 1.0
    after: float = 1.0


class Policy(Protocol):
    """One step of the covariance; `owed` is a product of factors by which P is divided as well."""

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, owed: float) -> Step: ...

    def loss(self) -> float:
        """Share of the information about each parameter that a step forgets; P_ii are given."""
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

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, owed: float) -> Step:
        return divided(P, phi, self.factor * owed)

    def loss(self) -> float:
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

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, owed: float) -> Step:
        self.k += 1
        return divided(P, phi, (1.0 - self.factor0**self.k * (1.0 - self.initial)) * owed)

    def loss(self) -> float:
        return float(self.factor0 ** (self.k + 1) * (1.0 - self.initial))


@dataclass
class ErrorDriven:
    """Fortescue, Kershenbaum, Ydstie 1981: gain, forgetting factor, then P, in this order.

    sigma0^2 as given, or where it is 0 the mean of like squares so far, from the 20th on, which
    rises slowly (error_driven.hpp).
    """

    memory: float
    least: float
    noise_variance: float = 0.0
    mean: float = 0.0
    seen: int = 0

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, owed: float) -> Step:
        square = epsilon**2 / (1.0 + phi @ P @ phi)
        known = self.noise_variance > 0.0 or self.seen >= 20
        sigma2 = self.noise_variance or self.mean
        factor = 1.0
        if known and sigma2:
            factor = max(1.0 - square / (sigma2 * self.memory), self.least)
        rate = 1.0 / min(self.seen + 1, self.memory)
        rise = rate * (square - self.mean)
        if self.seen >= 20 and self.mean > 0.0:
            rise = min(rise, self.mean * max(8.0 * rate, 1.0 / 16.0))
        self.mean += rise
        self.seen += 1
        K = P @ phi / (owed + phi @ P @ phi)
        kept = (np.eye(phi.size) - np.outer(K, phi)) @ P
        return Step(kept / (owed * factor), K, before=owed, after=factor)

    def loss(self) -> float:
        return 1.0 / self.memory


@dataclass
class FRatio:
    """Mohseni, Bernstein 2022: F of the errors in a short and a long window that end now."""

    eta: float
    critical: float
    short: int = 10
    long: int = 100
    errors: list[float] = field(default_factory=list)

    def step(self, P: FloatArray, phi: FloatArray, epsilon: float, owed: float) -> Step:
        self.errors = [*self.errors, epsilon][-self.long :]
        factor = 1.0
        if len(self.errors) == self.long:
            squares = np.square(self.errors)
            F = squares[-self.short :].mean() / squares.mean()
            g = np.sqrt(F / self.critical) - 1.0
            factor = 1.0 / (1.0 + self.eta * max(g, 0.0))
        return divided(P, phi, factor * owed)

    def loss(self) -> float:
        return 0.0


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
        self.usual = 0.0  # their mean, which rises slowly
        self.weight = 0.0  # sum of the weights
        self.weight_square = 0.0  # sum of their squares
        self.recent = 0.0  # the same squares, averaged over about 16 samples
        self.regained = np.ones(self.theta.size)  # of what was forgotten in the last memory
        self.owed = 1.0  # product of the forgetting factors that wait
        self.waited = 1.0  # the same of 1 - loss

    @property
    def residual_variance(self) -> float:
        """Weighted residual sum over the degrees of freedom, at least one."""
        return self.squares / self._freedom

    @property
    def parameter_variance(self) -> float:
        """The covariance of theta over P: sigma^2 sum(w^2) / sum(w)."""
        return self.residual_variance * self._share

    @property
    def _share(self) -> float:
        return self.weight_square / self.weight if self.weight > 0.0 else 1.0

    @property
    def _freedom(self) -> float:
        return max(self.weight - self.theta.size * self._share, 1.0)

    def update(self, phi: FloatArray, y: float) -> bool:
        """False where the sample is left out."""
        known = self.weight > phi.size + 1
        self.epsilon = y - phi @ self.theta  # (12)
        power = y**2 + float(phi @ self.theta) ** 2
        policy = copy(self.policy)  # a sample left out must not move the policy on
        s = phi @ self.P @ phi
        step = policy.step(self.P, phi, self.epsilon, 1.0)
        if not s > 0.0 and self.margin > 0.0:
            return False
        self.recent += (self.epsilon**2 * step.before / (step.before + s) - self.recent) / 16.0
        starved = self.margin > 0.0 and self.regained.min() < 0.4
        frozen = starved and known and self.recent <= 4.0 * self._usual_variance(power)
        waits = self.owed * step.before * step.after
        if self._uninformative(s, idle=frozen and self.waited <= 0.08):
            if not self._overdue(phi, power):
                self.regained -= self._loss * self.regained
                self.regained[self.regained <= 1e-6] = 0.0
                self._follow_fallen_errors(phi, s, power)
                return False
            frozen = False
        if frozen:
            step = divided(self.P, phi, 1.0)
        elif self.owed < 1.0:
            policy = copy(self.policy)
            step = policy.step(self.P, phi, self.epsilon, self.owed)
        self.owed = max(waits, 0.08) if frozen else 1.0
        self.waited = max(self.waited * (1.0 - self._loss), 0.08) if frozen else 1.0
        self.policy = policy
        self._keep(phi, step, power, known)
        return True

    def _keep(self, phi: FloatArray, step: Step, power: float, known: bool) -> None:
        # The mean of epsilon times the residual behind the step is sigma^2, converged or not.
        square = self.epsilon**2 * (1.0 - phi @ step.gain)
        self.P, self.gain = step.P, step.gain
        self.theta = self.theta + step.gain * self.epsilon  # (14)
        self.factor = step.before * step.after
        # The measurement took (P phi)_i^2 / alpha off P_ii, with 1 - phi' K = before / alpha.
        taken = step.gain**2 * step.before / (1.0 - phi @ step.gain)
        left = np.diag(step.P) * self.factor
        share = taken / (left + taken) - self._loss * self.regained
        self.regained = np.minimum(self.regained + share, 1.0)
        samples = step.before * self.weight + 1.0
        rise = (square - self.usual) / samples
        if known:
            most = self.usual + ROUNDING**2 * power
            rise = min(rise, most * max(24.0 / samples, 1.0 / 16.0))
        self.usual += rise
        self.squares = step.after * (step.before * self.squares + square)
        self.weight = step.after * samples
        self.weight_square = step.after**2 * (step.before**2 * self.weight_square + 1.0)

    def _usual_variance(self, power: float) -> float:
        """sigma^2 of the usual errors; a surprise is at least a rounding error."""
        return self.usual * self.weight / self._freedom + ROUNDING**2 * power / 4.0

    @property
    def _loss(self) -> float:
        """What the policy forgets, or the share of one sample among all."""
        return max(self.policy.loss(), 1.0 / (self.weight + 2 * self.theta.size))

    def _uninformative(self, s: float, idle: bool) -> bool:
        """The rule of RlsOptions::information_margin."""
        return idle and s < self.margin * self._loss

    def _overdue(self, phi: FloatArray, power: float) -> bool:
        """A regressor of full size is taken where the model fails, or where P is too small.

        Too small: of some parameter below that of full excitation by such regressors.
        """
        size = float(phi**2 @ self.variance0)
        least = float(np.min(np.diag(self.P) / self.variance0))
        full = least * size < self.margin * self._loss
        return size > 2e6 and (self.recent > 0.03 * power or full)

    def _follow_fallen_errors(self, phi: FloatArray, s: float, power: float) -> None:
        """sigma^2 falls to that of the recent errors; sigma^2 P stays, unless P0 bounds it."""
        known = self.weight > phi.size + 1
        variance = self.residual_variance if known else 0.0
        loss = self._loss
        predicts = self.recent < 1e-4 * power
        least = loss if predicts else self.margin * loss
        small = float(phi**2 @ self.variance0) <= 25.0
        if variance <= 10.0 * self.recent or small or s >= least:
            return
        fall = min(variance / self.recent, 1.0 / np.mean(np.diag(self.P) / self.variance0))
        if predicts:
            fall = min(fall, self.margin * loss / s)
        if fall > 1.0:
            self.P = self.P * fall
            self.squares /= fall
            self.usual /= fall
