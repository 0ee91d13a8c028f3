# SPDX-License-Identifier: MIT
"""What a model says of the plant: poles, zeros, gain, and the servo (5) where it is one.

The gain of a model that integrates, as a position servo does: speed per unit of the command.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import ehsid

from .arx import ArxModel
from .roots import Roots, poles_zeros

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
    return Dynamics(
        poles,
        _roots(roots.zeros, None, None),
        stable,
        gain,
        _static_gain(model) if stable and not integrates else None,
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
