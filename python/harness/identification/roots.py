# SPDX-License-Identifier: MIT
"""Poles and zeros of an ARX model with their uncertainty; how sure are stability and order?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.optimize
import scipy.stats

from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification.arx import ArxModel

ComplexArray = npt.NDArray[np.complex128]

# The delta method takes a root for a linear function of the coefficients. Near another root it is
# not: there the error in the linear term is of the order deviation / distance.
CLEAR_OF_OTHERS = 3.0

# Angles at which the unit circle is tried for a root, and places on the real axis.
N_ANGLES = 4097
N_PLACES = 801


@dataclass(frozen=True, eq=False)
class Roots:
    """Roots of a polynomial with estimated coefficients.

    Attributes
    ----------
    values
        shape (n,), in the z plane, by falling modulus.
    covariance
        shape (n, 2, 2), of real and imaginary part, to first order.
    reliable
        shape (n,), false where the nearest other root is closer than 3 standard deviations, as at
        a double root: there the covariance is not to be used.
    """

    values: ComplexArray
    covariance: FloatArray
    reliable: npt.NDArray[np.bool_]

    @property
    def modulus_deviation(self) -> FloatArray:
        """Standard deviation of |root|, shape (n,)."""
        size = np.abs(self.values)
        away = np.column_stack((self.values.real, self.values.imag))
        # At the origin the modulus has no derivative; along the real axis is as good as any.
        unit = np.where(
            size[:, None] > 0.0, away / np.where(size > 0.0, size, 1.0)[:, None], [1.0, 0.0]
        )
        variance = np.einsum("ni,nij,nj->n", unit, self.covariance, unit)
        return np.asarray(np.sqrt(variance), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class PolesZeros:
    """Of G(z) = z^-nk (b1 + .. + b_nb z^-(nb-1)) / (1 + a1 z^-1 + .. + a_na z^-na).

    Attributes
    ----------
    poles, zeros
        roots of z^na A and of z^(nb-1) B.
    origin_poles, origin_zeros
        what the delay adds at z = 0, exactly.
    """

    poles: Roots
    zeros: Roots
    origin_poles: int
    origin_zeros: int


def poles_zeros(model: ArxModel) -> PolesZeros:
    """Poles and zeros with covariances by the delta method.

    Parameters
    ----------
    model
        estimated model.
    """
    na, nb, nk = model.orders.na, model.orders.nb, model.orders.nk
    in_a, in_b = slice(0, na), slice(na, na + nb)
    a = np.concatenate(([1.0], model.a))
    of_a = np.zeros((na + 1, na + 1))  # the leading 1 is certain
    of_a[1:, 1:] = model.covariance[in_a, in_a]
    excess = na - nk - nb + 1
    return PolesZeros(
        _roots(a, of_a),
        _roots(model.b, model.covariance[in_b, in_b]),
        origin_poles=max(-excess, 0),
        origin_zeros=max(excess, 0),
    )


def stability_distance(model: ArxModel) -> float:
    """How far the model is from the border of stability, in standard deviations.

    A root of A on the unit circle at angle w is A(e^jw) = 0, two linear equations in a (one for
    z = 1 or -1). The distance is the least over w of sqrt(r' (C cov C')^-1 r), r = (Re A, Im A).
    Unlike deviations of single roots this holds for double roots too.
    """
    na = model.orders.na
    cov = model.covariance[:na, :na]
    powers = np.arange(1, na + 1)
    least = np.inf
    for angle in np.linspace(0.0, np.pi, N_ANGLES):
        c = np.exp(-1j * angle * powers)
        value = 1.0 + c @ model.a
        if angle in (0.0, np.pi):
            least = min(least, _wald(np.array([value.real]), c.real[None, :], cov))
        else:
            rows = np.vstack((c.real, c.imag))
            least = min(least, _wald(np.array([value.real, value.imag]), rows, cov))
    return float(np.sqrt(least))


@dataclass(frozen=True)
class Cancellation:
    """The common root of A and B that the data speak least against.

    Attributes
    ----------
    place
        in the z plane, upper half; one of a pair where complex.
    p_value
        of the hypothesis that it is one; large: the data do not rule out a lower order.
    """

    place: complex
    p_value: float


def nearest_cancellation(model: ArxModel) -> Cancellation | None:
    """Wald test of a common root; None where B has no root.

    A(r) = B(r) = 0 is linear in the coefficients for given r: two equations for a real r, four for
    a complex one. The least distance over r is chi-squared with one and two degrees of freedom.
    """
    na, nb = model.orders.na, model.orders.nb
    if nb < 2:
        return None
    found = poles_zeros(model)
    starts = np.concatenate((found.poles.values, found.zeros.values))
    cov = model.covariance[: na + nb, : na + nb]
    theta = model.theta[: na + nb]

    def distance(place: complex) -> float:
        rows = np.zeros((2, na + nb), dtype=np.complex128)
        rows[0, :na] = place ** np.arange(na - 1, -1, -1)
        rows[1, na:] = place ** np.arange(nb - 1, -1, -1)
        value = rows @ theta + np.array([place**na, 0.0])
        if place.imag == 0.0:
            return _wald(value.real, rows.real, cov)
        return _wald(
            np.concatenate((value.real, value.imag)), np.vstack((rows.real, rows.imag)), cov
        )

    def at_pair(x: FloatArray) -> float:
        return distance(complex(x[0], x[1]))

    places = np.sort(np.concatenate((starts.real, np.linspace(-2.0, 2.0, N_PLACES))))
    at = np.array([distance(complex(place)) for place in places])
    low = int(np.argmin(at))
    bounds = (places[max(low - 1, 0)], places[min(low + 1, places.size - 1)])
    real = scipy.optimize.minimize_scalar(lambda x: distance(complex(x)), bounds=bounds)
    best = Cancellation(complex(real.x), float(scipy.stats.chi2.sf(min(real.fun, at[low]), 1)))
    if na >= 2 and nb >= 3:
        for start in starts[starts.imag > 0.0]:
            fit = scipy.optimize.minimize(
                at_pair, np.array([start.real, start.imag]), method="Nelder-Mead"
            )
            p_value = float(scipy.stats.chi2.sf(fit.fun, 2))
            if p_value > best.p_value and fit.x[1] > 0.0:
                best = Cancellation(complex(fit.x[0], fit.x[1]), p_value)
    return best


def _roots(coefficients: FloatArray, covariance: FloatArray) -> Roots:
    """Roots of c0 z^n + .. + cn; dr/dc_i = -r^(n-i) / p'(r), by implicit differentiation."""
    values = np.asarray(np.roots(coefficients), dtype=np.complex128)
    values = values[np.lexsort((-values.imag, -np.abs(values)))]
    degree = coefficients.size - 1
    slope = np.polyval(np.polyder(coefficients), values)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        gradient = -(values[:, None] ** np.arange(degree, -1, -1)) / slope[:, None]
        jacobian = np.stack((gradient.real, gradient.imag), axis=1)
        spread = jacobian @ covariance @ jacobian.transpose(0, 2, 1)
    reliable = np.isfinite(spread).all(axis=(1, 2))
    for i in np.flatnonzero(reliable):
        others = np.abs(np.delete(values, i) - values[i])
        widest = float(np.sqrt(max(np.linalg.eigvalsh(spread[i])[-1], 0.0)))
        reliable[i] = others.size == 0 or others.min() > CLEAR_OF_OTHERS * widest
    return Roots(values, spread, reliable)


def _wald(value: FloatArray, rows: FloatArray, covariance: FloatArray) -> float:
    """V' (C cov C')^-1 v; infinite where the covariance leaves no room."""
    scale = np.linalg.norm(rows, axis=1)
    rows, value = rows / scale[:, None], value / scale
    try:
        return max(float(value @ np.linalg.solve(rows @ covariance @ rows.T, value)), 0.0)
    except np.linalg.LinAlgError:
        return np.inf
