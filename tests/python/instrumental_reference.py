# SPDX-License-Identifier: MIT
"""Instrumental variables, written anew with full matrices and np.roots.

Young 2011, ch. 7, symmetric form. No guards but the stability of the running model: a test must not
reach the others.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

FloatArray = npt.NDArray[np.float64]


def is_stable(a: FloatArray) -> bool:
    return bool(np.all(np.abs(np.roots([1.0, *a])) < 1.0))


def contracted(a: FloatArray, factor: float) -> FloatArray:
    return np.asarray(a * factor ** np.arange(1, a.size + 1))


class Gradient:
    """theta, P and sigma^2 of the Gauss-Newton recursion with lambda of Eq. (15)."""

    def __init__(self, variances: FloatArray, lambda0: float, initial: float) -> None:
        self.theta = np.zeros(variances.size)
        self.P = np.diag(variances)
        self.lambda0, self.deficit = lambda0, 1.0 - initial
        self.squares = self.weight = self.weight_square = 0.0

    def learn(self, psi: FloatArray, epsilon: float) -> None:
        self.deficit *= self.lambda0
        factor = 1.0 - self.deficit
        s = psi @ self.P @ psi
        gain = self.P @ psi / (factor + s)
        self.P = (self.P - np.outer(gain, psi @ self.P)) / factor
        self.P = 0.5 * (self.P + self.P.T)
        self.theta = self.theta + gain * epsilon
        self.squares = factor * self.squares + epsilon**2 * factor / (factor + s)
        self.weight = factor * self.weight + 1.0
        self.weight_square = factor**2 * self.weight_square + 1.0

    def deviation(self) -> FloatArray:
        share = self.weight_square / self.weight
        variance = self.squares / max(self.weight - share * self.theta.size, 1.0)
        return np.asarray(np.sqrt(variance * share * np.diag(self.P)))


class Filter:
    """w(k) = v(k) - f1 w(k-1) - ... - fn w(k-n), from zero."""

    def __init__(self, n: int, width: int) -> None:
        self.past = np.zeros((n, width))

    def step(self, f: FloatArray, v: FloatArray) -> FloatArray:
        w = np.asarray(v - f @ self.past)
        self.past = np.vstack((w, self.past[:-1]))
        return w


def equations(
    u: FloatArray, y: FloatArray, na: int, nb: int, integrator: bool
) -> tuple[FloatArray, FloatArray]:
    """Returns all phi(k) and the outputs that they explain, nk = 1.

    With a known integrator these are differences, and both sides are summed with a memory of 20.
    """
    s = np.diff(y, prepend=y[0]) if integrator else y
    at = np.arange(max(na, nb) + integrator, u.size)
    phi = np.stack([-s[at - i] for i in range(1, na + 1)] + [u[at - i] for i in range(1, nb + 1)])
    if not integrator:
        return phi.T, s[at]
    return lfilter([1.0], [1.0, -0.95], phi).T, lfilter([1.0], [1.0, -0.95], s[at])


def instrumental_variables(
    u: FloatArray,
    y: FloatArray,
    na: int = 3,
    nb: int = 3,
    lambda0: float = 0.995,
    initial: float = 0.98,
    settling: int = 200,
    integrator: bool = False,
) -> Gradient:
    """Runs over a record, nk = 1."""
    n = na + nb
    gradient = Gradient(np.full(n, 1e6), lambda0, initial)
    model = np.zeros(n)
    f = np.poly(np.full(na, 0.7))[1:]
    regressors, outputs = equations(u, y, na, nb, integrator)
    x = outputs.copy()  # of the running model, behind settling
    filter_z, filter_phi, filter_y = Filter(na, n), Filter(na, n), Filter(na, 1)
    taken = 0
    for k, phi in enumerate(regressors):
        settled = taken >= settling
        z = np.concatenate((-x[k - np.arange(1, na + 1)], phi[na:])) if settled else phi
        psi, phi_f = filter_z.step(f, z), filter_phi.step(f, phi)
        y_f = filter_y.step(f, outputs[k : k + 1])[0]
        mixed = np.concatenate((phi_f[:na], psi[na:]))
        gradient.learn(psi, y_f - mixed @ gradient.theta)
        if taken + 1 < settling:
            taken += 1
        else:
            first = taken + 1 == settling
            next_model = gradient.theta if first else model + 0.03 * (gradient.theta - model)
            next_f = f + 0.03 * (contracted(next_model[:na], 0.99) - f)
            stable = is_stable(contracted(next_model[:na], 0.999)) and is_stable(next_f)
            if stable:
                model, f = next_model, next_f
            if stable or not first:
                taken = min(taken + 1, settling)
        if settled:
            x[k] = np.concatenate((contracted(model[:na], 0.999), model[na:])) @ z
    return gradient
