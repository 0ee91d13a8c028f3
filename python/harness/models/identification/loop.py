# SPDX-License-Identifier: MIT
"""Closed loop of a proportional controller and a model: stability margins, poles, damping.

The control law is u = k (r - y). All figures come from python-control. Import this module
directly, see `systems`.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray

# Lowest and highest frequency at which crossovers are searched, as shares of half the sampling
# rate, and number of frequencies. They are dense enough for the splines through the response.
LOWEST, HIGHEST, N_FREQUENCIES = 1e-6, 1.0 - 1e-6, 2000

# Poles closer to z = 0 than this are delays. They have neither a natural frequency nor a damping.
DELAY = 1e-9


@dataclass(frozen=True)
class Mode:
    """A real pole or a pair of complex poles, with frequency and damping of s = ln(z) / dt.

    Attributes
    ----------
    pole
        position in the z plane; of a pair, the pole with the imaginary part >= 0.
    frequency_hz
        natural frequency |s| / (2 pi) in Hz.
    damping
        damping ratio -Re(s) / |s|; below 0 for a pole outside the unit circle.
    """

    pole: complex
    frequency_hz: float
    damping: float


@dataclass(frozen=True)
class ProportionalLoop:
    """Closed loop with one controller gain k.

    Attributes
    ----------
    gain
        k, in units of the model input per unit of its output.
    stable
        whether all poles of the closed loop are inside the unit circle.
    gain_margin
        factor by which k may grow up to the stability limit; below 1 if k is beyond the limit,
        infinite if there is no limit.
    phase_margin_deg, gain_crossover_hz
        phase above -180 degrees at the frequency where |k G| = 1, and this frequency; None if
        |k G| is 1 at no frequency. Of several such frequencies, the one with the phase margin
        closest to 0.
    modes
        modes of the closed loop, by increasing frequency.
    """

    gain: float
    stable: bool
    gain_margin: float
    phase_margin_deg: float | None
    gain_crossover_hz: float | None
    modes: tuple[Mode, ...]


@dataclass(frozen=True)
class LoopAnalysis:
    """Proportional control of a model: its limit gain, and the loops with two gains.

    Attributes
    ----------
    modes
        modes of the model in open loop, by increasing frequency.
    limit_gain
        gain k of the smallest magnitude at which the closed loop oscillates. Its sign is the one
        with which the loop counteracts an error. None if no gain makes the loop oscillate.
    phase_crossover_hz
        frequency of this oscillation, at which the phase of k G is -180 degrees.
    unity
        closed loop with |k| = 1.
    half
        closed loop with half the limit gain, a gain margin of 2 (6 dB); None if there is no limit.
    """

    modes: tuple[Mode, ...]
    limit_gain: float | None
    phase_crossover_hz: float | None
    unity: ProportionalLoop
    half: ProportionalLoop | None

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
