# SPDX-License-Identifier: MIT
"""Compares the frequency of the load on its oil spring with a ringing in the pressures."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import welch

from ..base.arrays import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, POSITION
from ..diagnosis.data.cylinder import oil_spring_hz
from ..records import Record
from ..rigs import Rig
from .finding import Finding, judged, untold
from .motion import areas, has_pressures

# A ringing is looked for between these multiples of the expected frequency.
SEARCHED = (0.35, 2.8)
# Its power over that beside it; random spectra of the averages that are taken stay below a few.
PROMINENT = 8.0
# A narrower line, frequency over width, is a pump or the mains, not an oil spring.
SHARPEST = 40.0
# Share of the Nyquist frequency up to which a spectrum is that of the machine.
USED_BAND = 0.8


def ringing_finding(record: Record, rig: Rig) -> list[Finding]:
    """Compares the ringing of a record without gaps with the oil spring of the rig."""
    expected = oil_spring_hz(rig)
    if expected is None or rig.plant != "ehs":
        return []
    assert record.dt_s is not None
    check, key = "oil spring", "fluid.bulk_modulus_pa"
    top = USED_BAND * 0.5 / record.dt_s
    told = f"mass and oil of the rig ring at {expected:.3g} Hz at mid-stroke"
    if expected > top:
        return [
            untold(
                check,
                f"{told}; sampled every {1e3 * record.dt_s:.3g} ms, the record shows nothing "
                f"above {top:.3g} Hz",
                key,
            )
        ]
    seen = _ringing_hz(record, rig, expected, top)
    if seen is None:
        return [
            untold(check, f"{told}; the record shows no ringing: a step command excites it", key)
        ]
    sigmas = [rig.sigma(name) for name in (key, "load.mass_kg", "cylinder.dead_volume_a_m3")]
    # The frequency goes with the square root of each, and changes along the stroke.
    tolerance = 2.0 * math.hypot(0.1, 0.5 * math.hypot(*sigmas))
    square = (seen / expected) ** 2
    good = f"{told}; the record rings at {seen:.3g} Hz"
    bad = (
        f"{good}: stiffness over mass is {square:.3g} times that of the rig; change "
        f"{key} by this factor, or load.mass_kg by {1.0 / square:.3g}"
    )
    return [judged(check, key, seen / expected, tolerance, (good, bad))]


def _ringing_hz(record: Record, rig: Rig, expected: float, top: float) -> float | None:
    """Frequency of the ringing that stands out most; None if none does."""
    assert record.dt_s is not None
    if has_pressures(record):
        area = areas(rig)
        p_a, p_b = (record.column(name) for name in CHAMBER_PRESSURES)
        signal = area.cap * p_a - area.annulus * p_b
    else:
        signal = np.diff(record.column(POSITION), 2)
    # Lines of a twentieth of the expected frequency, and at least eight averages.
    length = min(round(20.0 / (expected * record.dt_s)), signal.size // 4)
    if length < 32:
        return None
    frequency, power = welch(signal, 1.0 / record.dt_s, nperseg=length)
    inside = (frequency > SEARCHED[0] * expected) & (frequency < min(SEARCHED[1] * expected, top))
    best: tuple[float, float] | None = None
    for i in np.flatnonzero(inside).tolist():
        if 0 < i < power.size - 1 and power[i] >= max(power[i - 1], power[i + 1]):
            standing_out = _prominence(frequency, power, i)
            if standing_out > PROMINENT and (best is None or standing_out > best[0]):
                best = (standing_out, float(frequency[i]))
    return None if best is None else best[1]


def _prominence(frequency: FloatArray, power: FloatArray, i: int) -> float:
    """Power of a peak over the larger one of both sides; 0 for a line of a pump."""
    f = frequency[i]
    below = power[(frequency > 0.45 * f) & (frequency < 0.7 * f)]
    above = power[(frequency > 1.4 * f) & (frequency < 2.2 * f)]
    if below.size < 3 or above.size < 3:
        return 0.0
    high = power > 0.5 * power[i]
    left = i - int(np.argmin(high[i::-1])) if not high[: i + 1].all() else 0
    right = i + int(np.argmin(high[i:])) if not high[i:].all() else power.size - 1
    width = frequency[right] - frequency[left]
    if f / width > SHARPEST:
        return 0.0
    return float(power[i] / max(np.median(below), np.median(above), 1e-300))
