# SPDX-License-Identifier: MIT
"""The rig's own sampled frequency response, from command to position, by a small multisine.

Strictly it is the best linear approximation for this excitation (R. Pintelon, J. Schoukens, System
Identification: A Frequency Domain Approach, 2nd ed., 2012, ch. 3 and 4): what a linear model can at
best say of the rig at this amplitude. Where the rig is smooth it tends to the linearisation as the
amplitude falls; where it has friction at rest, a dead band or a single-ended cylinder, whose gain
differs between the directions at any amplitude, it does not, and the amplitude matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ehsid.harness.excitation import odd_multisine
from ehsid.harness.identification import FrequencyResponse
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import SimulationError
from ehsid.harness.simulation.run import prepare

PERIOD = 400  # samples
MOST_PERIODS = 60
SETTLED = 1e-4
SEED = 1  # of the phases


@dataclass(frozen=True, eq=False)
class SmallSignal(FrequencyResponse):
    """A rig's response, and how far it is to be trusted.

    Attributes
    ----------
    amplitude_v
        peak of the excitation.
    position0_m
        where it was applied; None: mid-stroke.
    unsettled
        largest change of the response from the last period but one to the last, of its size: what
        is left of the transients.
    distortion
        rms of the position's steps at odd lines that were not excited, of that at those that were:
        what no linear model of the rig can say.
    trim_v
        constant added to the command to keep the rod where it is.
    """

    amplitude_v: float
    position0_m: float | None
    unsettled: float
    distortion: float
    trim_v: float


def small_signal_response(
    rig: Rig,
    dt_s: float,
    *,
    amplitude_v: float,
    position0_m: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> SmallSignal:
    """Excite the simulated rig periodically until its transients are gone; divide the spectra.

    The position integrates: its steps y(k) - y(k-1) are taken, which are periodic also where it
    drifts, and their spectrum is divided by 1 - e^(-jw dt). A constant is added to the command,
    corrected from period to period, that keeps the rod where it is: cylinders of unequal areas and
    loads drift without one.

    Parameters
    ----------
    rig
        the machine.
    dt_s
        sampling time in seconds; the command is held for it.
    amplitude_v
        peak of the command, > 0.
    position0_m
        where to start; mid-stroke by default.
    band_hz
        lowest and highest frequency; by default from 1 / (400 dt_s) to 0.96 / (2 dt_s). Odd
        multiples of 1 / (400 dt_s) inside are excited, one in four of them left out.

    Returns
    -------
    The response at the excited lines, without covariance: the simulator has no noise here.

    Raises
    ------
    SimulationError
        an amplitude out of range, a rig that cannot be simulated, or one that runs out of stroke
        or does not settle.
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
    stroke = start.told.get("cylinder.stroke_m", np.inf)

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
        # At the lowest line the response is velocity gain / (jw): it tells what stops the drift.
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
