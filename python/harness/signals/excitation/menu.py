# SPDX-License-Identifier: MIT
"""Menu of excitations among which an experiment is chosen: shapes and sizes of the command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base.numbers import FloatArray
from .excitation import multisine
from .shapes import chirp, random_steps, triangle

# Upper end of the excited band: above the corner frequency of any servo valve whose lag matters.
DESIGN_FAST_HZ = 150.0

# A function that returns a signal in [-1, 1], shape (n,), from n and the sampling time dt_s.
Shape = Callable[[int, float], FloatArray]
SEED = 7


@dataclass(frozen=True)
class Entry:
    """An excitation of the menu."""

    description: str
    """Description for the operator; {speed} in mm/s and {size} in per cent are filled in."""
    size: float
    """Amplitude of the command, as a share of its limit."""
    shape: Shape
    """Function that returns the shape of the command."""


def _triangle(period_s: float, n: int, dt_s: float) -> FloatArray:
    # Four samples a period are the fewest that make a triangle.
    return triangle(n, dt_s, amplitude=1.0, period_s=max(period_s, 4.0 * dt_s))


def _steps(hold_s: tuple[float, float], n: int, dt_s: float) -> FloatArray:
    hold = max(round(hold_s[0] / dt_s), 1), max(round(hold_s[1] / dt_s), 1)
    rng = np.random.default_rng(SEED)
    return random_steps(n, amplitude=1.0, hold=hold, rng=rng)


def _multisine(low_hz: float, n: int, dt_s: float) -> FloatArray:
    rng = np.random.default_rng(SEED)
    return multisine(n, dt_s, band_hz=_band(low_hz, dt_s), peak=1.0, rng=rng)


def _chirp(n: int, dt_s: float) -> FloatArray:
    return chirp(n, dt_s, amplitude=1.0, band_hz=_band(1.0, dt_s))


def _band(low_hz: float, dt_s: float) -> tuple[float, float]:
    """The excited band, Hz, as far as the sampling carries it; it has an octave at least."""
    high_hz = min(DESIGN_FAST_HZ, 0.4 / dt_s)
    return min(low_hz, 0.5 * high_hz), high_hz


def _away_from_null(n: int, dt_s: float) -> FloatArray:
    """Forward and back at a steady speed, with a small triangle on it; shape (n,)."""
    slow = np.sign(np.sin(2.0 * np.pi * 0.5 * np.arange(n) * dt_s))
    return np.asarray(0.85 * slow + 0.15 * _triangle(0.25, n, dt_s))


def _pauses(n: int, dt_s: float) -> FloatArray:
    """Moves of 0.25 s in alternating directions, with rests of 0.75 s between them; shape (n,)."""
    phase = np.arange(n) * dt_s
    moving = phase % 1.0 < 0.25
    return np.where(moving, np.sign(np.sin(np.pi * np.floor(phase) + 0.5)), 0.0)


def _everything(n: int, dt_s: float) -> FloatArray:
    """Slow triangle, small reversals, fast multisine and large steps in sequence; shape (n,)."""
    part = n // 4
    shapes = (
        0.05 * _triangle(1.0, part, dt_s),
        0.02 * _triangle(0.25, part, dt_s),
        0.4 * _multisine(1.0, part, dt_s),
        _steps((0.05, 0.2), n - 3 * part, dt_s),
    )
    whole = np.concatenate([shape - shape.mean() for shape in shapes])
    return whole / max(1.0, float(np.abs(whole).max()))


MENU = (
    Entry("slow triangle, {speed:.2g} mm/s, 8 reversals", 0.02, partial(_triangle, 2.0)),
    Entry("slow triangle, {speed:.2g} mm/s, 8 reversals", 0.08, partial(_triangle, 2.0)),
    Entry("triangle, {speed:.2g} mm/s, 16 reversals", 0.3, partial(_triangle, 1.0)),
    Entry(
        "triangle up to {size:.0f} % of the command, 32 reversals", 0.95, partial(_triangle, 0.5)
    ),
    Entry(
        "small reversals about null, {size:.0f} % of the command", 0.03, partial(_triangle, 0.25)
    ),
    Entry(
        "steady speed of {size:.0f} % to and fro, with small reversals on it", 0.3, _away_from_null
    ),
    Entry("moves at {size:.0f} % with rests between", 0.2, _pauses),
    Entry("random steps up to {size:.0f} %", 0.08, partial(_steps, (0.1, 0.4))),
    Entry("random steps up to {size:.0f} %", 0.3, partial(_steps, (0.1, 0.4))),
    Entry("random steps up to {size:.0f} %", 0.95, partial(_steps, (0.04, 0.2))),
    Entry(
        "multisine from 0.5 Hz past the valve, up to {size:.0f} %", 0.1, partial(_multisine, 0.5)
    ),
    Entry("multisine from 2 Hz past the valve, up to {size:.0f} %", 0.6, partial(_multisine, 2.0)),
    Entry("chirp from 1 Hz past the valve, {size:.0f} %", 0.15, _chirp),
    Entry(
        "slow triangle, small reversals, fast multisine, steps up to {size:.0f} %",
        0.8,
        _everything,
    ),
)
