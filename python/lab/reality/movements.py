# SPDX-License-Identifier: MIT
"""Movements with long rests in between, as operators and test programmes command them.

All speeds are shares of the speed at full opening. Positions are shares of the travel to one side
of the working point, so that a movement at full speed takes `crossing_s` from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from ehsid.harness.base.arrays import FloatArray

Movement = Literal["joystick", "trapezoid", "stepped_sine", "growing"]
MOVEMENTS: tuple[Movement, ...] = ("joystick", "trapezoid", "stepped_sine", "growing")
REST_SHARES = (0.1, 0.4)  # of the record
STICK_DEAD_ZONE = 0.03  # share of the stick's travel that moves nothing, about its centre


def draw_movement(
    rng: np.random.Generator,
    kind: Movement,
    samples: int,
    dt_s: float,
    size: float,
    crossing_s: float,
) -> FloatArray:
    """Draws the speed, (samples,), of a movement with rests in 10 to 40 % of the samples.

    Parameters
    ----------
    size
        largest share of the full speed, above 0 and up to 1.
    crossing_s
        time from one end of the travel to the other at full speed, s.
    """
    resting = round(float(rng.uniform(*REST_SHARES)) * samples)
    draw = {
        "joystick": _joystick,
        "trapezoid": _trapezoids,
        "stepped_sine": _stepped_sine,
        "growing": _growing,
    }[kind]
    return _with_rests(rng, draw(rng, samples - resting, dt_s, size, crossing_s), samples, resting)


def _with_rests(
    rng: np.random.Generator, pieces: Sequence[FloatArray], samples: int, resting: int
) -> FloatArray:
    """Joins the pieces, with two to six rests behind some of them; `resting` is their sum.

    The last piece has no rest behind it: it may end amid a movement.
    """
    places = max(len(pieces) - 1, 1)
    count = min(int(rng.integers(2, 7)), places)
    behind = np.sort(rng.permutation(places)[:count])
    weights = rng.uniform(0.5, 1.5, count)
    lengths = np.diff(np.rint(resting * np.cumsum(weights) / weights.sum()), prepend=0.0)
    parts: list[FloatArray] = []
    for i, piece in enumerate(pieces):
        parts.append(piece)
        parts += [np.zeros(int(n)) for n in lengths[behind == i]]
    return np.concatenate(parts)[:samples]


def _cut(pieces: Sequence[FloatArray], samples: int) -> list[FloatArray]:
    """Returns the pieces up to this number of samples."""
    ends = np.cumsum([piece.size for piece in pieces])
    last = int(np.searchsorted(ends, samples))
    return [*pieces[:last], pieces[last][: pieces[last].size - int(ends[last]) + samples]]


def _target(rng: np.random.Generator, position: float) -> float:
    """Draws a position at least 0.2 away from this one, both within -1 to 1."""
    ends = [end for end in (-1.0, 1.0) if abs(end - position) > 0.2]
    end = ends[int(rng.integers(len(ends)))]
    room = abs(end - position)
    return position + math.copysign(float(rng.uniform(0.2 / room, 1.0)) * room, end - position)


def _joystick(
    rng: np.random.Generator, samples: int, dt_s: float, size: float, crossing_s: float
) -> list[FloatArray]:
    """Deflections of a stick by a hand of 2 to 5 Hz; a piece ends at the centre of the stick."""
    deflections: list[FloatArray] = []
    position = 0.0
    while sum(part.size for part in deflections) < samples:
        way = _target(rng, position) - position
        duration = float(np.clip(crossing_s * rng.uniform(0.4, 2.0), 0.1, 2.0))
        # A full crossing changes the position by 2.
        level = min(size * float(rng.uniform(0.2, 1.0)), 0.5 * abs(way) * crossing_s / duration)
        position += math.copysign(2.0 * level * duration / crossing_s, way)
        deflections.append(np.full(max(round(duration / dt_s), 1), math.copysign(level, way)))
    pole = math.exp(-2.0 * math.pi * float(rng.uniform(2.0, 5.0)) * dt_s)
    smooth = np.concatenate(deflections)[:samples]
    for _ in range(2):
        smooth = np.asarray(lfilter([1.0 - pole], [1.0, -pole], smooth))
    beyond = np.maximum(np.abs(smooth) - STICK_DEAD_ZONE, 0.0) / (1.0 - STICK_DEAD_ZONE)
    signal = np.copysign(beyond, smooth)
    centred = np.flatnonzero((signal[1:] == 0.0) & (signal[:-1] != 0.0)) + 1
    return list(np.split(signal, centred))


def _trapezoids(
    rng: np.random.Generator, samples: int, dt_s: float, size: float, crossing_s: float
) -> list[FloatArray]:
    """Moves from point to point: the speed rises and falls in ramps of 30 to 300 ms."""
    pieces: list[FloatArray] = []
    position = 0.0
    while sum(piece.size for piece in pieces) < samples:
        target = _target(rng, position)
        area = 0.5 * abs(target - position) * crossing_s  # full speed times time, s
        ramp = math.exp(float(rng.uniform(math.log(0.03), math.log(0.3))))
        level = min(size * float(rng.uniform(0.25, 1.0)), area / ramp)
        hold = area / level - ramp
        time = dt_s * np.arange(max(math.ceil((2.0 * ramp + hold) / dt_s), 1))
        rise = np.minimum(time, 2.0 * ramp + hold - time) / ramp
        pieces.append(math.copysign(level, target - position) * np.clip(rise, 0.0, 1.0))
        position = target
    return _cut(pieces, samples)


def _largest_amplitude(frequency_hz: float, crossing_s: float) -> float:
    """Amplitude of a sine of the speed whose cycle moves the rod from the centre to an end."""
    # 2 a v / omega = x, where v crosses 2 x in `crossing_s`
    return 0.5 * math.pi * frequency_hz * crossing_s


def _stepped_sine(
    rng: np.random.Generator, samples: int, dt_s: float, size: float, crossing_s: float
) -> list[FloatArray]:
    """Four to eight frequencies one after the other, each in whole cycles of one amplitude."""
    count = int(rng.integers(4, 9))
    low = max(0.4, 0.2 * size / (0.5 * math.pi * crossing_s))
    high = min(max(float(rng.uniform(4.0, 14.0)), 2.0 * low), 0.1 / dt_s)
    pieces: list[FloatArray] = []
    for frequency in np.geomspace(low, high, count):
        amplitude = min(
            size * float(rng.uniform(0.3, 1.0)), _largest_amplitude(frequency, crossing_s)
        )
        cycle = round(1.0 / (frequency * dt_s))
        wave = amplitude * np.sin(2.0 * math.pi * np.arange(cycle) / cycle)
        wave *= float(rng.choice([-1.0, 1.0]))
        pieces += [wave] * math.ceil(samples / count / cycle)
    return _cut(pieces, samples)


def _growing(
    rng: np.random.Generator, samples: int, dt_s: float, size: float, crossing_s: float
) -> list[FloatArray]:
    """Cycles of one frequency, a sine or a triangle of the position, from 5 % of `size` to it.

    A triangle has half the speed: instant reversals at full command would pull the rod side empty.
    """
    is_triangle = bool(rng.random() < 0.5)
    largest = 0.5 * size if is_triangle else size
    lowest = max(largest / (0.5 * math.pi * crossing_s), 0.3)
    frequency = min(lowest * math.exp(float(rng.uniform(0.0, math.log(4.0)))), 12.0)
    cycle = max(round(1.0 / (frequency * dt_s)), 8)
    wave = np.sin(2.0 * math.pi * np.arange(cycle) / cycle)
    if is_triangle:
        wave = np.where(np.arange(cycle) < cycle // 2, 1.0, -1.0)
    largest = min(largest, _largest_amplitude(1.0 / (cycle * dt_s), crossing_s))
    cycles = math.ceil(samples / cycle)
    amplitudes = largest * np.linspace(0.05, 1.0, cycles)
    return _cut([amplitude * wave for amplitude in amplitudes], samples)
