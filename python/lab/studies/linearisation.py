# SPDX-License-Identifier: MIT
"""Sampled frequency response of a simulated rig, from command to position, by a small multisine.

The response is the best linear approximation for this excitation (R. Pintelon, J. Schoukens, System
Identification: A Frequency Domain Approach, 2nd ed., 2012, ch. 3 and 4): no linear model describes
the rig better at this amplitude. For a smooth rig it tends to the linearisation as the amplitude
falls. With static friction, a dead band or a single-ended cylinder, whose gain differs between the
directions at any amplitude, it does not: the response then depends on the amplitude.

Samples the servo read from an estimate again, by `ehsid.discretise` and by python-control.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.models.identification import FrequencyResponse
from ehsid.harness.models.identification.loop import servo_system
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.excitation import odd_multisine
from ehsid.harness.signals.simulation import SimulationError
from ehsid.harness.signals.simulation.run import prepare

from .reading import Reading


@dataclass(frozen=True, eq=False)
class SampledServo:
    """Coefficients a1, a2, a3, b1, b2, b3 of Eq. (6) from three sources, each of shape (6,)."""

    gain: float
    omega_n: float
    xi: float
    """Parameters of the servo (5): K in m/(s V), omega_n in rad/s, damping ratio."""
    estimate: FloatArray
    """Estimated theta from which these parameters were read."""
    ours: FloatArray
    """Coefficients with zero-order hold by `ehsid.discretise`."""
    by_control: FloatArray
    """Coefficients with zero-order hold by python-control, from the matrix exponential of its state
    space."""


def sample_again(reading: Reading, dt_s: float) -> SampledServo | None:
    """Samples the servo of the last valid reading; returns None if no reading is valid.

    Parameters
    ----------
    reading
        physical parameters over a record; a reading is valid if its status is "ok".
    dt_s
        sampling time in seconds.
    """
    good = [i for i, status in enumerate(reading.status) if status == "ok"]
    if not good:
        return None
    gain, omega_n, xi = (float(value) for value in reading.value[good[-1]])
    servo = ehsid.ContinuousServo(gain=gain, omega_n=omega_n, xi=xi)
    sampled = control.sample_system(servo_system(servo), dt_s, method="zoh")
    # The numerator has three coefficients. python-control omits leading zeros, so they are added.
    numerator = sampled.num[0][0]
    return SampledServo(
        gain,
        omega_n,
        xi,
        reading.theta[good[-1]],
        np.asarray(ehsid.discretise(servo, dt_s), dtype=np.float64),
        np.concatenate((sampled.den[0][0][1:], np.zeros(3 - numerator.size), numerator)),
    )


PERIOD = 400  # samples
MOST_PERIODS = 60
SETTLED = 1e-4
SEED = 1  # of the phases


@dataclass(frozen=True, eq=False)
class SmallSignal(FrequencyResponse):
    """Frequency response of a rig, and figures that tell how reliable it is."""

    amplitude_v: float
    """Peak of the excitation in V."""
    position0_m: float | None
    """Initial position of the rod in m; None: mid-stroke."""
    unsettled: float
    """Largest change of the response between the last two periods, as a share of its largest
    magnitude: the remaining transients."""
    distortion: float
    """Rms of the position steps at the odd lines that were not excited, as a share of the rms at
    the excited lines: the part that no linear model of the rig can describe."""
    trim_v: float
    """Constant in V added to the command to keep the rod in place."""


def small_signal_response(
    rig: Rig,
    dt_s: float,
    *,
    amplitude_v: float,
    position0_m: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> SmallSignal:
    """Excites the simulated rig periodically until its transients decay, and divides the spectra.

    The position integrates and may drift. Its steps y(k) - y(k-1) are periodic also then, so their
    spectrum is used and divided by 1 - e^(-jw dt). A constant added to the command, corrected after
    each period, keeps the rod in place: without it, cylinders with unequal areas or with a load
    drift. The excitation ends after 60 periods at the latest; `unsettled` tells what is left.

    Parameters
    ----------
    rig
        the rig to simulate.
    dt_s
        sampling time in seconds; the command is held for this time.
    amplitude_v
        peak of the command in V, > 0.
    position0_m
        initial position of the rod in m; mid-stroke by default.
    band_hz
        lowest and highest frequency in Hz; by default from 1 / (400 dt_s) to 0.96 / (2 dt_s). The
        odd multiples of 1 / (400 dt_s) in this band are excited, but one in four is left out.

    Returns
    -------
    The response at the excited lines, without covariance: the simulation has no noise here.

    Raises
    ------
    SimulationError
        the amplitude or the band is out of range, the rig cannot be simulated, or it reaches an
        end of its stroke.
    """
    if not 0.0 < amplitude_v < np.inf:
        raise SimulationError(f"amplitude_v = {amplitude_v:g}: expected a finite number above 0")
    low, high = band_hz or (1.0 / (PERIOD * dt_s), 0.48 / dt_s)
    try:
        excitation = odd_multisine(
            PERIOD, dt_s, band_hz=(low, high), peak=amplitude_v, rng=np.random.default_rng(SEED)
        )
    except ValueError as error:
        raise SimulationError(str(error)) from error
    lines, left_out = excitation.excited, excitation.detection
    command = np.fft.rfft(excitation.samples)
    start = prepare(rig, dt_s=dt_s, position0_m=position0_m)
    plant = start.plant(quantised=False)
    stroke = start.values.get("cylinder.stroke_m", np.inf)

    constant = 0.0
    last, before = float(plant.read()[0]), np.zeros(lines.size, dtype=np.complex128)
    back = np.exp(-2j * np.pi * lines / PERIOD)
    change = np.inf
    for _ in range(MOST_PERIODS):
        position = plant.run(excitation.samples + constant)[:, 0]
        inside = (position >= 0.0) & (position <= stroke) if stroke < np.inf else True
        if not np.all(np.isfinite(position) & inside):
            raise SimulationError(
                f"{rig.name} leaves its stroke under a multisine of {amplitude_v:g} V: take a "
                "smaller amplitude or another start"
            )
        steps = np.fft.rfft(np.diff(position, prepend=last))
        drift, last = float(position[-1]) - last, float(position[-1])
        response = steps[lines] / command[lines] / (1.0 - back)
        change = float(np.max(np.abs(response - before)) / np.max(np.abs(response)))
        before = response
        # At the lowest line the response is velocity gain / (jw). The velocity gain gives the
        # constant that stops the drift.
        gain = float(np.abs(response[0])) * 2.0 * np.pi * float(lines[0]) / (PERIOD * dt_s)
        constant -= drift / (gain * PERIOD * dt_s) if gain > 0.0 else 0.0
        if change < SETTLED:
            break
    excited = float(np.sqrt(np.mean(np.abs(steps[lines]) ** 2)))
    others = float(np.sqrt(np.mean(np.abs(steps[left_out]) ** 2)))
    return SmallSignal(
        lines / (PERIOD * dt_s),
        response,
        f"{rig.name}, multisine of {amplitude_v:g} V",
        amplitude_v,
        position0_m,
        change,
        others / excited if excited > 0.0 else 0.0,
        constant,
    )
