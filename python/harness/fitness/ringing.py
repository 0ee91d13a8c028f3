# SPDX-License-Identifier: MIT
"""Compares the frequency of the load on its oil spring with a ringing in the pressures.

What the chamber pressures say about the areas and the supply, whatever the load is.

Both edges of a valve have the same opening and the same rated flow (Merritt, Hydraulic Control
Systems, Wiley 1967, ch. 6). The rated flow that the edge at A needs is in proportion to the area at
the cap side, that at B to the one at the rod side. So they only agree with the right ratio of the
areas. A wrong supply pressure makes the edge at A need too much extending and the edge at B
retracting, because these two are the edges from the supply; an offset of the valve's null changes
both edges in the same way.

What the force balance of a record says about the mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.signal import welch

from ..base.numbers import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION, SUPPLY_PRESSURE
from ..diagnosis.data.floor import sensor_floor
from ..diagnosis.data.gate_signs import BLOCKS, jackknife
from ..diagnosis.data.repeats import oil_spring_hz
from ..records import Record
from ..rigs import Rig
from .finding import Finding, judged, untold
from .motion import Areas, FlowGain, Kernel, Motion, areas, flow_gain, has_pressures, kernel

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


# The supply pressure is looked for between these multiples of the rig's.
SUPPLY_RANGE = (0.4, 2.5)


@dataclass(frozen=True)
class Edges:
    """Ratio of the areas and supply pressure that the chamber pressures fit."""

    part: float
    """Area at the rod side over area at the cap side."""
    supply_pa: float | None
    """Supply pressure at the valve, absolute, Pa; None where it is measured."""
    gain: FlowGain
    """Rated flow with this supply pressure."""


def edges(record: Record, rig: Rig, moved: Motion, area: Areas) -> Edges | None:
    """Determines ratio and supply; None without pressures or without motion both ways."""
    if not has_pressures(record):
        return None
    supply = None
    if SUPPLY_PRESSURE not in record.columns:
        supply = _supply(record, rig, moved, area)
        if supply is None:
            return None
    gain = flow_gain(record, rig, moved, area, supply)
    if gain.edge_a is None or gain.edge_b is None or _sides(gain) is None:
        return None
    return Edges(area.annulus / area.cap * gain.edge_a / gain.edge_b, supply, gain)


def _supply(record: Record, rig: Rig, moved: Motion, area: Areas) -> float | None:
    """Supply pressure with which both edges agree on the difference between the directions."""
    known = rig.values["supply.pressure_pa"]

    def off(factor: float) -> float:
        sides = _sides(flow_gain(record, rig, moved, area, factor * known))
        return math.nan if sides is None else sides

    # Below the largest chamber pressure an edge passes nothing, and nothing can be told.
    factors = np.geomspace(*SUPPLY_RANGE, 25).tolist()
    found = [off(factor) for factor in factors]
    for i in range(len(factors) - 1):
        if found[i] * found[i + 1] < 0.0:
            return float(known * brentq(off, factors[i], factors[i + 1], xtol=1e-3))
    return None


def _sides(gain: FlowGain) -> float | None:
    """Logarithm of (a_out / a_back) / (b_out / b_back); None if one of them cannot be told."""
    if not (gain.a_out and gain.a_back and gain.b_out and gain.b_back):
        return None
    return math.log(gain.a_out / gain.a_back * gain.b_back / gain.b_out)


# Durations of the kernel that are tried, s, the shortest first: a longer one has less noise, and
# less of the fast accelerations.
DURATIONS_S = (0.03, 0.04, 0.06, 0.08, 0.12, 0.16, 0.24, 0.32)
# Noise makes an estimate too small by its share of the power of the acceleration.
NOISE_SHARE = 0.02
# Duration of the kernel for the sign of the speed, s.
SIGN_S = 0.01


@dataclass(frozen=True)
class Mass:
    """Moved mass that balances the pressures, kg, and its standard deviation."""

    value: float
    deviation: float


def moved_mass(record: Record, rig: Rig, area: Areas) -> Mass | None:
    """Fits the force balance of a record without gaps; None where the noise hides it.

        m y'' + b y' + F_c sgn y' + k y + F_0 = A_a p_a - A_b p_b = F

    The terms are smoothed by one kernel, and the deviation is that of `jackknife`. A measured
    command stands for nothing here: the balance holds whatever moves the valve. A drive has the
    force of its command.
    """
    assert record.dt_s is not None
    if rig.plant == "axis":
        force = rig.values["axis.force_per_volt"] * record.column(COMMAND)
    elif all(name in record.columns for name in CHAMBER_PRESSURES):
        p_a, p_b = (record.column(name) for name in CHAMBER_PRESSURES)
        force = area.cap * p_a - area.annulus * p_b
    else:
        return None
    position = record.column(POSITION)
    noise = sensor_floor(record, POSITION, rig).value
    for duration in DURATIONS_S:
        smoothing = kernel(duration, record.dt_s)
        if len(record) < 20 * smoothing.phi.size:
            return None
        acceleration = smoothing.smooth(position, 2)
        by_noise = noise**2 * float(smoothing.second @ smoothing.second)
        if by_noise < NOISE_SHARE * float(np.var(acceleration)):
            return _fitted(*_terms(position, force, smoothing, record.dt_s))
    return None


def _terms(
    position: FloatArray, force: FloatArray, smoothing: Kernel, dt_s: float
) -> tuple[FloatArray, FloatArray]:
    """Smoothed terms of the balance, shape (n, 4), and the smoothed force, shape (n,)."""
    short = kernel(SIGN_S, dt_s)
    # The sign is that of the speed before smoothing, as far as noise allows to tell it.
    sign = np.sign(short.smooth(position, 1))
    inner = slice(short.half, position.size - short.half)
    smooth = smoothing.smooth
    y = position[inner]
    terms = [smooth(y, 2), smooth(y, 1), smooth(sign), smooth(y)]
    return np.column_stack(terms), smooth(force[inner])


def _fitted(terms: FloatArray, force: FloatArray) -> Mass:
    """Weight of the first term, with the deviation of a jackknife and of what remains."""
    size = np.abs(terms).max(axis=0)
    size = np.where(size > 0.0, size, 1.0)
    columns = np.column_stack([terms / size, np.ones(force.size)])
    whole, parts = jackknife(columns, force)
    others = columns[:, 1:]
    own = columns[:, 0] - others @ np.linalg.lstsq(others, columns[:, 0], rcond=1e-12)[0]
    # A term that is missing, such as friction near standstill, can look like the acceleration: the
    # remaining force over the acceleration that no other term has bounds what this does.
    missing = np.std(force - columns @ whole) / max(float(np.std(own)), 1e-300)
    deviation = np.hypot(np.sqrt((BLOCKS - 1) * np.var([part[0] for part in parts])), missing)
    return Mass(float(whole[0] / size[0]), float(deviation / size[0]))
