# SPDX-License-Identifier: MIT
"""The loop that a proportional controller closes around a model: margins, poles, damping.

u = k (r - y). All figures come from python-control. Import this module itself, see `systems`.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray

# Where crossovers are looked for: shares of half the sampling rate, close enough to each other
# for the splines through them.
LOWEST, HIGHEST, N_FREQUENCIES = 1e-6, 1.0 - 1e-6, 2000

# Poles closer to z = 0 than this are delays: they have neither frequency nor damping.
DELAY = 1e-9


@dataclass(frozen=True)
class Mode:
    """A real pole or a pair of complex ones, as those of s = ln(z) / dt.

    Attributes
    ----------
    pole
        in the z plane, that with the imaginary part >= 0.
    frequency_hz
        natural frequency |s| / (2 pi).
    damping
        ratio -Re(s) / |s|; below 0 for a pole outside the unit circle.
    """

    pole: complex
    frequency_hz: float
    damping: float


@dataclass(frozen=True)
class ProportionalLoop:
    """The loop with one gain k.

    Attributes
    ----------
    gain
        k, input of the model over its output.
    stable
        whether all poles of the closed loop are inside the unit circle.
    gain_margin
        factor on k up to the limit of stability, below 1 beyond it; infinite if there is none.
    phase_margin_deg, gain_crossover_hz
        phase above -180 degrees where k |G| = 1; None where it is nowhere 1. Of several such
        frequencies that with the smallest margin.
    modes
        of the closed loop, by rising frequency.
    """

    gain: float
    stable: bool
    gain_margin: float
    phase_margin_deg: float | None
    gain_crossover_hz: float | None
    modes: tuple[Mode, ...]


@dataclass(frozen=True)
class LoopAnalysis:
    """What proportional control of a model can reach.

    Attributes
    ----------
    modes
        of the model, by rising frequency.
    limit_gain
        k of the smallest size at which the closed loop oscillates; it has the sign with which the
        loop counteracts an error. None where no gain makes the loop oscillate.
    phase_crossover_hz
        at which it then oscillates: the phase of k G is -180 degrees.
    unity
        the loop with |k| = 1.
    half
        the loop with half the limit, a gain margin of 2 (6 dB); None where there is no limit.
    """

    modes: tuple[Mode, ...]
    limit_gain: float | None
    phase_crossover_hz: float | None
    unity: ProportionalLoop
    half: ProportionalLoop | None

    @property
    def loops(self) -> tuple[ProportionalLoop, ...]:
        """Those that there are, unity first."""
        return (self.unity,) if self.half is None else (self.unity, self.half)


def analyse_loop(system: control.TransferFunction) -> LoopAnalysis:
    """Close a proportional loop around a model, with unity gain and with half the limit.

    Parameters
    ----------
    system
        discrete-time model as of `arx_system`; without a sampling time, frequencies are in cycles
        a sample.
    """
    dt_s = 1.0 if system.dt is True else float(system.dt)
    omega = np.pi / dt_s * np.geomspace(LOWEST, HIGHEST, N_FREQUENCIES)
    response = np.asarray(system(np.exp(1j * omega * dt_s)), dtype=np.complex128)
    # The output follows the command where the steps of both have the same sign: where B(1) > 0.
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
    """Smallest gain at a phase crossover, and the angular frequency there."""
    frd = control.FrequencyResponseData(response, omega)
    gains, _, _, crossovers, _, _ = control.stability_margins(frd, returnall=True)
    found = list(zip(gains.tolist(), crossovers.tolist(), strict=True))
    # At half the sampling rate the response is real: where it is negative, the phase is -180
    # degrees. python-control leaves this frequency out.
    last = sign * float(np.real(system(-1.0)))
    if last < 0.0:
        found.append((-1.0 / last, float(omega[-1]) / HIGHEST))
    return min(found, default=(None, None))


def _modes(system: control.TransferFunction) -> tuple[Mode, ...]:
    # The logarithm of a pole at z = 0, of a delay, is infinite.
    with np.errstate(divide="ignore", invalid="ignore"):
        frequencies, dampings, poles = control.damp(system, doprint=False)
    modes = [
        Mode(complex(pole), float(frequency) / (2.0 * np.pi), float(damping))
        for pole, frequency, damping in zip(poles, frequencies, dampings, strict=True)
        if pole.imag >= 0.0 and abs(pole) > DELAY
    ]
    return tuple(sorted(modes, key=lambda mode: mode.frequency_hz))
