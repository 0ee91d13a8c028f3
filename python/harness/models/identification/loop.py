# SPDX-License-Identifier: MIT
"""Closed loop of a proportional controller and a model: stability margins, poles, damping.

The control law is u = k (r - y). All figures come from python-control. Import this module
directly, see `systems`.

Converts models to python-control systems, for Bode plots, margins, closed loops, simulation.

>>> system = to_control(result.chosen.model, data.dt_s)
>>> control.bode_plot(system, display_margins=True)

Import this module directly: `ehsid.harness.models.identification` does not import it, because
python-control takes a second to import.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
import numpy.typing as npt

import ehsid

from ...base.numbers import FloatArray
from .arx import ArxModel
from .data import ArxOrders, IdentificationError


def arx_system(
    orders: ArxOrders, theta: npt.ArrayLike, dt_s: float | None
) -> control.TransferFunction:
    """Returns G(z) = z^-nk (b1 + .. + b_nb z^-(nb-1)) / (1 + a1 z^-1 + .. + a_na z^-na).

    This is Eq. (7) of Ghazali et al. 2011 from input to output, without the constant term.

    Parameters
    ----------
    orders
        structure of the model.
    theta
        shape (na + nb,) or, with the constant term, (na + nb + 1,): a1 .. a_na, b1 .. b_nb.
    dt_s
        sampling time in seconds, > 0; None if it is not known, time then counts samples.

    Returns
    -------
    Discrete-time system with one input `u` and one output `y`, with numerator and denominator in
    powers of z.

    Raises
    ------
    IdentificationError
        theta does not have the shape of the structure, or dt_s is not above 0.
    """
    values = np.asarray(theta, dtype=np.float64)
    na, nb, nk = orders.na, orders.nb, orders.nk
    if values.shape not in ((na + nb,), (orders.n_parameters,)):
        raise IdentificationError(
            f"theta has shape {values.shape}, expected ({orders.n_parameters},) for {orders}"
        )
    if dt_s is not None and not 0.0 < dt_s < np.inf:
        raise IdentificationError(f"dt_s = {dt_s:g}: expected a finite number above 0")
    # Numerator and denominator are multiplied by z^degree, with the largest delay in either of them
    # as degree.
    degree = max(na, nk + nb - 1)
    denominator = np.zeros(degree + 1)
    denominator[0], denominator[1 : na + 1] = 1.0, values[:na]
    numerator = np.zeros(degree + 1)
    numerator[nk : nk + nb] = values[na : na + nb]
    return control.TransferFunction(
        numerator, denominator, True if dt_s is None else dt_s, inputs="u", outputs="y"
    )


def to_control(model: ArxModel, dt_s: float | None) -> control.TransferFunction:
    """Returns an estimated model as a system of python-control, see `arx_system`.

    Parameters
    ----------
    model
        estimated model.
    dt_s
        sampling time in seconds, as in `IoData.dt_s`; None if it is not known.
    """
    return arx_system(model.orders, model.theta, dt_s)


def servo_system(servo: ehsid.ContinuousServo) -> control.TransferFunction:
    """Returns G(s) = K wn^2 / (s (s^2 + 2 xi wn s + wn^2)), from command to position.

    Ghazali et al. 2011, Eq. (5). `control.sample_system(servo_system(servo), dt_s, "zoh")` gives
    the system that `ehsid.discretise(servo, dt_s)` computes without a matrix exponential.

    Parameters
    ----------
    servo
        gain K in m/(s V), natural frequency wn in rad/s, damping ratio xi.
    """
    stiffness = servo.omega_n**2
    return control.TransferFunction(
        [servo.gain * stiffness],
        [1.0, 2.0 * servo.xi * servo.omega_n, stiffness, 0.0],
        inputs="u",
        outputs="y",
    )


# Lowest and highest frequency at which crossovers are searched, as shares of half the sampling
# rate, and number of frequencies. They are dense enough for the splines through the response.
LOWEST, HIGHEST, N_FREQUENCIES = 1e-6, 1.0 - 1e-6, 2000

# Poles closer to z = 0 than this are delays. They have neither a natural frequency nor a damping.
DELAY = 1e-9


@dataclass(frozen=True)
class Mode:
    """A real pole or a pair of complex poles, with frequency and damping of s = ln(z) / dt."""

    pole: complex
    """Position in the z plane; of a pair, the pole with the imaginary part >= 0."""
    frequency_hz: float
    """Natural frequency |s| / (2 pi) in Hz."""
    damping: float
    """Damping ratio -Re(s) / |s|; below 0 for a pole outside the unit circle."""


@dataclass(frozen=True)
class ProportionalLoop:
    """Closed loop with one controller gain k.

    Attributes
    ----------
    phase_margin_deg, gain_crossover_hz
        phase above -180 degrees at the frequency where |k G| = 1, and this frequency; None if
        |k G| is 1 at no frequency. Of several such frequencies, the one with the phase margin
        closest to 0.
    """

    gain: float
    """k, in units of the model input per unit of its output."""
    stable: bool
    """Whether all poles of the closed loop are inside the unit circle."""
    gain_margin: float
    """Factor by which k may grow up to the stability limit; below 1 if k is beyond the limit,
    infinite if there is no limit."""
    phase_margin_deg: float | None
    gain_crossover_hz: float | None
    modes: tuple[Mode, ...]
    """Modes of the closed loop, by increasing frequency."""


@dataclass(frozen=True)
class LoopAnalysis:
    """Proportional control of a model: its limit gain, and the loops with two gains."""

    modes: tuple[Mode, ...]
    """Modes of the model in open loop, by increasing frequency."""
    limit_gain: float | None
    """Gain k of the smallest magnitude at which the closed loop oscillates. Its sign is the one
    with which the loop counteracts an error. None if no gain makes the loop oscillate."""
    phase_crossover_hz: float | None
    """Frequency of this oscillation, at which the phase of k G is -180 degrees."""
    unity: ProportionalLoop
    """Closed loop with |k| = 1."""
    half: ProportionalLoop | None
    """Closed loop with half the limit gain, a gain margin of 2 (6 dB); None if there is no limit.
    """

    @property
    def loops(self) -> tuple[ProportionalLoop, ...]:
        """Loops that exist: the one with unity gain, then the one with half the limit gain."""
        return (self.unity,) if self.half is None else (self.unity, self.half)


def analyse_loop(system: control.TransferFunction) -> LoopAnalysis:
    """Closes a proportional loop around a model, with unity gain and with half the limit gain.

    Parameters
    ----------
    system
        discrete-time model as from `arx_system`. Without a sampling time, frequencies are in
        cycles per sample.
    """
    dt_s = 1.0 if system.dt is True else float(system.dt)
    omega = np.pi / dt_s * np.geomspace(LOWEST, HIGHEST, N_FREQUENCIES)
    response = np.asarray(system(np.exp(1j * omega * dt_s)), dtype=np.complex128)
    # The output moves in the direction of the command if the sum of the numerator, B(1), is > 0.
    # The loop then counteracts an error with a positive gain.
    sign = 1.0 if float(np.sum(system.num[0][0])) >= 0.0 else -1.0
    limit, crossover = _limit(system, sign * response, sign, omega)
    oscillates = None if limit is None else sign * limit

    def loop(size: float) -> ProportionalLoop:
        frd = control.FrequencyResponseData(size * sign * response, omega)
        _, margins, _, _, crossovers, _ = control.stability_margins(frd, returnall=True)
        closest = int(np.argmin(np.abs(margins))) if margins.size else None
        closed = control.feedback(sign * size * system, 1)
        return ProportionalLoop(
            gain=sign * size,
            stable=bool(np.all(np.abs(closed.poles()) < 1.0)),
            gain_margin=np.inf if limit is None else limit / size,
            phase_margin_deg=None if closest is None else float(margins[closest]),
            gain_crossover_hz=(
                None if closest is None else float(crossovers[closest]) / (2.0 * np.pi)
            ),
            modes=_modes(closed),
        )

    return LoopAnalysis(
        _modes(system),
        oscillates,
        None if crossover is None else crossover / (2.0 * np.pi),
        loop(1.0),
        None if limit is None else loop(0.5 * limit),
    )


def _limit(
    system: control.TransferFunction, response: npt.ArrayLike, sign: float, omega: FloatArray
) -> tuple[float | None, float | None]:
    """Returns the smallest gain at a phase crossover, and its angular frequency in rad/s."""
    frd = control.FrequencyResponseData(response, omega)
    gains, _, _, crossovers, _, _ = control.stability_margins(frd, returnall=True)
    limits = list(zip(gains.tolist(), crossovers.tolist(), strict=True))
    # At half the sampling rate the response is real. If it is negative, the phase is -180 degrees.
    # python-control leaves this frequency out.
    last = sign * float(np.real(system(-1.0)))
    if last < 0.0:
        limits.append((-1.0 / last, float(omega[-1]) / HIGHEST))
    return min(limits, default=(None, None))


def _modes(system: control.TransferFunction) -> tuple[Mode, ...]:
    # A delay has a pole at z = 0, whose logarithm is infinite.
    with np.errstate(divide="ignore", invalid="ignore"):
        frequencies, dampings, poles = control.damp(system, doprint=False)
    modes = [
        Mode(complex(pole), float(frequency) / (2.0 * np.pi), float(damping))
        for pole, frequency, damping in zip(poles, frequencies, dampings, strict=True)
        if pole.imag >= 0.0 and abs(pole) > DELAY
    ]
    return tuple(sorted(modes, key=lambda mode: mode.frequency_hz))
