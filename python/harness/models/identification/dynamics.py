# SPDX-License-Identifier: MIT
"""What a model says of the plant: poles, zeros, gain and stability, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.optimize
import scipy.stats

import ehsid

from ...base.numbers import FloatArray
from .arx import ArxModel

ComplexArray = npt.NDArray[np.complex128]

# The delta method treats a root as a linear function of the coefficients. This does not hold near
# another root: there the relative error of the linear term is of the order deviation / distance.
CLEAR_OF_OTHERS = 3.0

# Number of angles at which the unit circle is searched for a root, and number of points at which
# the real axis is searched.
N_ANGLES = 4097
N_PLACES = 801


@dataclass(frozen=True, eq=False)
class Roots:
    """Roots of a polynomial with estimated coefficients."""

    values: ComplexArray
    """Shape (n,), roots in the z plane, by decreasing modulus."""
    covariance: FloatArray
    """Shape (n, 2, 2), covariance of real and imaginary part of each root, to first order."""
    reliable: npt.NDArray[np.bool_]
    """Shape (n,), false where the nearest other root is closer than 3 standard deviations, as at a
    double root. The covariance of such a root must not be used."""

    @property
    def modulus_deviation(self) -> FloatArray:
        """Standard deviation of |root|, shape (n,)."""
        size = np.abs(self.values)
        away = np.column_stack((self.values.real, self.values.imag))
        # At the origin the modulus has no derivative. Any direction will do; the real axis is used.
        unit = np.where(
            size[:, None] > 0.0, away / np.where(size > 0.0, size, 1.0)[:, None], [1.0, 0.0]
        )
        variance = np.einsum("ni,nij,nj->n", unit, self.covariance, unit)
        return np.asarray(np.sqrt(variance), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class PolesZeros:
    """Poles, zeros of G(z) = z^-nk (b1 + .. + b_nb z^-(nb-1)) / (1 + a1 z^-1 + .. + a_na z^-na)."""

    poles: Roots
    zeros: Roots
    """Roots of z^na A and of z^(nb-1) B."""
    origin_poles: int
    origin_zeros: int
    """Number of further poles and zeros at z = 0; they follow from na, nb and nk without error."""


def poles_zeros(model: ArxModel) -> PolesZeros:
    """Returns poles and zeros of a model with their covariances by the delta method.

    Parameters
    ----------
    model
        estimated model.
    """
    na, nb, nk = model.orders.na, model.orders.nb, model.orders.nk
    in_a, in_b = slice(0, na), slice(na, na + nb)
    a = np.concatenate(([1.0], model.a))
    of_a = np.zeros((na + 1, na + 1))  # the leading coefficient 1 has no uncertainty
    of_a[1:, 1:] = model.covariance[in_a, in_a]
    excess = na - nk - nb + 1
    return PolesZeros(
        _estimated_roots(a, of_a),
        _estimated_roots(model.b, model.covariance[in_b, in_b]),
        origin_poles=max(-excess, 0),
        origin_zeros=max(excess, 0),
    )


def stability_distance(model: ArxModel) -> float:
    """Distance of the model from the stability limit, in standard deviations.

    A has a root on the unit circle at angle w if A(e^jw) = 0. These are two linear equations in
    the coefficients a, or one for z = 1 or -1. The distance is the minimum over w of
    sqrt(r' (C cov C')^-1 r) with r = (Re A, Im A). Unlike the standard deviations of single roots
    it is also valid for double roots.
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
    """Common root of A and B for which the data give the least evidence against."""

    place: complex
    """Position of the root in the upper half of the z plane; a complex root stands for its pair."""
    p_value: float
    """p-value of the hypothesis that A and B share this root. If it is large, the data do not rule
    out a lower order."""


def nearest_cancellation(model: ArxModel) -> Cancellation | None:
    """Returns the result of the Wald test for a common root of A and B; None if B has no root.

    A(r) = B(r) = 0 is linear in the coefficients for a given r: two equations for a real r, four
    for a complex r. The minimum of the squared distance over r is chi-squared distributed, with
    one degree of freedom for a real r and two for a complex r.
    """
    na, nb = model.orders.na, model.orders.nb
    if nb < 2:
        return None
    own = poles_zeros(model)
    starts = np.concatenate((own.poles.values, own.zeros.values))
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


def _estimated_roots(coefficients: FloatArray, covariance: FloatArray) -> Roots:
    """Returns the roots of p(z) = c0 z^n + .. + cn with their covariances.

    dr/dc_i = -r^(n-i) / p'(r), by implicit differentiation.
    """
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
    """Returns the Wald statistic v' (C cov C')^-1 v; infinite if C cov C' is singular."""
    scale = np.linalg.norm(rows, axis=1)
    rows, value = rows / scale[:, None], value / scale
    try:
        return max(float(value @ np.linalg.solve(rows @ covariance @ rows.T, value)), 0.0)
    except np.linalg.LinAlgError:
        return np.inf


# A pole counts as an integrator if it cannot be told from z = 1 at this many deviations.
DEVIATIONS = 3.0


def integrator(model: ArxModel) -> int | None:
    """Returns which pole of `poles_zeros(model)` is an integrator; None if the model has none.

    The model integrates if its real pole that is nearest to z = 1 cannot be told from it, or moves
    away from it by less than 1/e over the record from which the model was estimated.
    """
    poles = poles_zeros(model).poles
    away = np.abs(1.0 - poles.values)
    nearest = int(np.argmin(np.where(poles.values.imag == 0.0, away, np.inf)))
    distance = float(away[nearest])
    deviation = float(np.sqrt(max(poles.covariance[nearest, 0, 0], 0.0)))
    told_apart = distance > DEVIATIONS * deviation if poles.reliable[nearest] else True
    if poles.values[nearest].imag != 0.0 or (told_apart and distance * model.n_rows > 1.0):
        return None
    return nearest


def velocity_gain(model: ArxModel, dt_s: float) -> float | None:
    """Returns K in G(z) ~ K dt / (z - 1) at low frequencies; None if the model does not integrate.

    This is the K of Ghazali et al. 2011, Eq. (5). The pole that `integrator` names is taken as
    z = 1: K = B(1) / (dt prod (1 - p_i)), over all other poles p_i.

    Parameters
    ----------
    model
        estimated model.
    dt_s
        sampling time in seconds.

    Returns
    -------
    K in units of the output a second and unit of the input.
    """
    nearest = integrator(model)
    if nearest is None:
        return None
    others = np.delete(poles_zeros(model).poles.values, nearest)
    return float(np.sum(model.b) / (dt_s * np.prod(1.0 - others)).real)


# Largest imaginary part of a root that counts as real; a pair is told by its upper root.
REAL = 1e-9
# A pole nearer to z = 0 is a delay: it has neither a natural frequency nor a damping.
DELAY = 1e-9


@dataclass(frozen=True)
class Figure:
    """A figure of a model with its standard deviation; None where the latter is not known."""

    value: float
    deviation: float | None


@dataclass(frozen=True)
class Root:
    """A pole or a zero in the z plane; a pair of complex ones is one, with the upper root."""

    real: float
    imag: float
    """Where it is; imag is 0 for a real root and above 0 for a pair."""
    deviation: float | None
    """Standard deviation of its distance from z = 0; None where another root is too near to tell.
    """
    frequency_hz: float | None = None
    damping: float | None = None
    """Natural frequency |s| / (2 pi) and damping ratio -Re(s) / |s| of a pole, s = ln(z) / dt; None
    for a zero, for a delay, for an integrator, and without a sampling time."""
    integrates: bool = False
    """Whether it is a pole that cannot be told from z = 1, as `velocity_gain.integrator` says; its
    frequency and damping would be those of rounding errors."""


@dataclass(frozen=True)
class Servo:
    """G(s) = K wn^2 / (s (s^2 + 2 xi wn s + wn^2)), Ghazali et al. 2011, Eq. (5)."""

    gain: Figure
    """Velocity gain K, units of the output a second and unit of the input."""
    omega_n: Figure
    """Natural frequency, rad/s."""
    xi: Figure
    """Damping ratio."""


@dataclass(frozen=True)
class Dynamics:
    """What a model says of the plant."""

    poles: tuple[Root, ...]
    zeros: tuple[Root, ...]
    """Without those at z = 0 that follow from the structure."""
    stable: bool
    """Whether no pole lies outside of the unit circle, besides an integrator."""
    velocity_gain: Figure | None
    """K of a model that integrates, units of the output a second and unit of the input; None for
    one that does not or is unstable, and without a sampling time."""
    static_gain: Figure | None
    """B(1) / A(1) of a stable model that does not integrate: output over input at rest; else None.
    """
    lag_s: Figure | None
    """How late such a model follows a slow input, in seconds, its delay included: -d arg G / d
    omega at omega = 0. None without a static gain or a sampling time."""
    servo: Servo | None
    """The servo that the model is; None where it is none."""
    why_no_servo: str
    """Why the model cannot be read as a servo, in a sentence; "" where it can."""


def dynamics(model: ArxModel, dt_s: float | None) -> Dynamics:
    """Returns what an estimated model says of the plant.

    Parameters
    ----------
    model
        estimated model.
    dt_s
        sampling time in seconds; None if it is not known.
    """
    roots = poles_zeros(model)
    poles = _roots(roots.poles, dt_s, integrator(model))
    stable = all(one.integrates or abs(complex(one.real, one.imag)) <= 1.0 for one in poles)
    servo, why = _servo(model, dt_s)
    # Whether a model integrates does not depend on the unit of time.
    slope = velocity_gain(model, dt_s or 1.0)
    integrates = slope is not None or servo is not None
    gain = None if servo is None else servo.gain
    if gain is None and slope is not None and dt_s is not None and stable:
        gain = Figure(slope, None)
    at_rest = stable and not integrates
    return Dynamics(
        poles,
        _roots(roots.zeros, None, None),
        stable,
        gain,
        _static_gain(model) if at_rest else None,
        _lag(model, dt_s) if at_rest and dt_s is not None else None,
        servo,
        why,
    )


def _roots(roots: Roots, dt_s: float | None, at_one: int | None) -> tuple[Root, ...]:
    """Returns the roots; with frequency and damping where a sampling time is given.

    at_one: place of the root that is an integrator; None if there is none.
    """
    found = []
    for i, (value, deviation, reliable) in enumerate(
        zip(roots.values.tolist(), roots.modulus_deviation.tolist(), roots.reliable, strict=True)
    ):
        if value.imag < -REAL:
            continue
        imag = value.imag if value.imag > REAL else 0.0
        frequency = damping = None
        if dt_s is not None and abs(value) > DELAY and i != at_one:
            s = complex(np.log(complex(value.real, imag))) / dt_s
            if abs(s) > 0.0:
                frequency, damping = abs(s) / (2.0 * np.pi), -s.real / abs(s)
        known = deviation if reliable and np.isfinite(deviation) else None
        found.append(Root(value.real, imag, known, frequency, damping, i == at_one))
    return tuple(found)


def _static_gain(model: ArxModel) -> Figure | None:
    """Returns B(1) / A(1) with its deviation by the delta method; None if A(1) is zero."""
    na, nb = model.orders.na, model.orders.nb
    at_rest = 1.0 + float(np.sum(model.a))
    if at_rest == 0.0:
        return None
    gain = float(np.sum(model.b)) / at_rest
    slope = np.concatenate((np.full(na, -gain), np.ones(nb))) / at_rest
    variance = float(slope @ model.covariance[: na + nb, : na + nb] @ slope)
    return Figure(gain, float(np.sqrt(variance)) if variance >= 0.0 else None)


def _lag(model: ArxModel, dt_s: float) -> Figure | None:
    """Returns dt (sum k b_k / B(1) - sum k a_k / A(1)), k in samples; None if a sum is zero.

    Each term is the mean of k with the coefficients as weights, whose derivative by a coefficient
    is (k - mean) / sum: the deviation is by the delta method.
    """
    orders = model.orders
    at_a, at_b = np.arange(1, orders.na + 1), orders.nk + np.arange(orders.nb)
    of_a, of_b = 1.0 + float(np.sum(model.a)), float(np.sum(model.b))
    if of_a == 0.0 or of_b == 0.0:
        return None
    in_a, in_b = float(at_a @ model.a) / of_a, float(at_b @ model.b) / of_b
    slope = dt_s * np.concatenate((-(at_a - in_a) / of_a, (at_b - in_b) / of_b))
    used = slope.size
    variance = float(slope @ model.covariance[:used, :used] @ slope)
    return Figure(dt_s * (in_b - in_a), float(np.sqrt(variance)) if variance >= 0.0 else None)


def _servo(model: ArxModel, dt_s: float | None) -> tuple[Servo | None, str]:
    """Reads a model as the servo (5); with the reason where this is not possible."""
    orders = model.orders
    if (orders.na, orders.nb) != (3, 3):
        return None, (
            "only a model with na = nb = 3 can be read as a servo with K, omega_n and xi; this one "
            f"has na = {orders.na} and nb = {orders.nb}"
        )
    if dt_s is None:
        return None, "omega_n in rad/s needs the sampling time, which the record does not have"
    reading = ehsid.identify_servo(model.theta[:6], model.covariance[:6, :6], dt_s)
    if reading.status != ehsid.ServoReadingStatus.ok:
        return None, reading.description
    return (
        Servo(
            Figure(reading.gain, reading.gain_std),
            Figure(reading.omega_n, reading.omega_n_std),
            Figure(reading.xi, reading.xi_std),
        ),
        "",
    )
