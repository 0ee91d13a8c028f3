# SPDX-License-Identifier: MIT
"""Excitation of a position servo: the motions that an experimenter would command.

Nothing here depends on an effect; amplitudes follow from the values in the rig file.

Movements with long rests in between, as operators and test programmes command them.

All speeds are shares of the speed at full opening. Positions are shares of the travel to one side
of the working point, so that a movement at full speed takes `crossing_s` from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from ehsid.harness.base.numbers import FloatArray

from .nominal_rig import NominalRig, spread

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


Experiment = Literal["multisine", "steps", "triangle", "chirp", "prbs"]
Excitation = Literal[Experiment, Movement]
EXCITATIONS: tuple[Experiment, ...] = ("multisine", "steps", "triangle", "chirp", "prbs")
ExcitationSet = Literal["all", "training", "validation"]
# Kinds of wide records. What is calibrated on one set can be tested on the other: no kind is in
# both, and those that are alike are in the same.
EXCITATION_SETS: Mapping[ExcitationSet, tuple[Excitation, ...]] = MappingProxyType(
    {
        "all": (*EXCITATIONS, *MOVEMENTS),
        "training": ("multisine", "steps", "prbs", "joystick", "trapezoid"),
        "validation": ("triangle", "chirp", "stepped_sine", "growing"),
    }
)
EXPERIMENTS_SHARE = 0.4  # of wide records are of the kinds without rests
TRAVEL = 0.28  # share of the stroke, to each side of the working point
# Largest bandwidth of the position loop, rad per sample: the command that is held for a sample then
# takes less than 10 degrees of phase from the loop.
LARGEST_GAIN = 0.3
WEAK_LOOP_RAD_S = 1.5


@dataclass(frozen=True)
class Task:
    """Inputs of the position controller.

    `forward`, (n,), is a fraction of the rated command, `reference`, (n,), a position in m, and
    `gain` a fraction of the rated command per m.
    """

    forward: FloatArray
    reference: FloatArray
    gain: float


def draw_task(
    rng: np.random.Generator,
    rig: NominalRig,
    kind: Excitation,
    samples: int,
    dt_s: float,
    small: bool,
    weak_loop_rad_s: float | None,
) -> Task:
    """Draws a reference, its feed-forward, and a gain that the rig as configured tolerates.

    Parameters
    ----------
    small
        whether the motion is slow and small: up to 1.5 Hz and 15 % of the rated command.
    weak_loop_rad_s
        bandwidth of the loop, rad/s, where the feed-forward is the command, and the loop only keeps
        the rod from drifting away; None: it controls the position.
    """
    working_point = rig.stroke_m * float(rng.uniform(0.42, 0.58)) if rig.plant == "ehs" else 0.0
    bandwidth = float(np.clip(rng.uniform(0.25, 0.6) * rig.damping_1_s, 1.5, 25.0))
    bandwidth = min(bandwidth, LARGEST_GAIN / dt_s)
    if weak_loop_rad_s is not None:
        bandwidth = weak_loop_rad_s
    gain = bandwidth / rig.speed_m_s
    size = float(rng.uniform(0.05, 0.15) if small else rng.uniform(0.6, 1.0))
    if kind == "steps":
        levels = working_point + _steps(rng, rig, samples, dt_s, size / gain)
        return Task(np.zeros(samples), levels, gain)
    if kind in MOVEMENTS:
        crossing_s = 2.0 * TRAVEL * rig.stroke_m / rig.speed_m_s
        movement = draw_movement(rng, kind, samples, dt_s, size, crossing_s)
        return _along(movement, rig, working_point, gain, dt_s)
    relative_speed = {
        "multisine": _multisine,
        "triangle": _triangle,
        "chirp": _chirp,
        "prbs": _prbs,
    }[kind](rng, rig, samples, dt_s, size, small)
    return _along(relative_speed - relative_speed.mean(), rig, working_point, gain, dt_s)


def _along(
    relative_speed: FloatArray, rig: NominalRig, working_point: float, gain: float, dt_s: float
) -> Task:
    """Returns the task of this speed, which is reduced to keep the rod within the travel."""
    path = rig.speed_m_s * dt_s * np.concatenate(([0.0], np.cumsum(relative_speed)[:-1]))
    path -= 0.5 * (path.max() + path.min())
    reduction = min(1.0, TRAVEL * rig.stroke_m / max(float(np.abs(path).max()), 1e-9))
    return Task(reduction * relative_speed, working_point + reduction * path, gain)


def weak_loop(rig: NominalRig) -> float:
    """Bandwidth, rad/s, of the loop that keeps a wide machine in open loop from drifting away.

    Fast machines drift faster: a speed that is wrong by a fifth then moves the rod by a fifth of
    the stroke at most. Half of the decay of the oil spring keeps the loop stable.
    """
    return max(WEAK_LOOP_RAD_S, min(rig.speed_m_s / rig.stroke_m, 0.5 * rig.damping_1_s))


def draw_excitations(
    rng: np.random.Generator, among: ExcitationSet
) -> tuple[Excitation, Excitation]:
    """Draws two kinds of this set for a wide case; each has rests in three of five cases."""
    drawn: list[Excitation] = []
    for _ in range(2):
        is_experiment = bool(rng.random() < EXPERIMENTS_SHARE)
        left = [
            kind
            for kind in EXCITATION_SETS[among]
            if (kind in EXCITATIONS) == is_experiment and kind not in drawn
        ]
        drawn.append(left[int(rng.integers(len(left)))])
    return drawn[0], drawn[1]


def _lowest_hz(rig: NominalRig, size: float) -> float:
    """Frequency, Hz, at which a sine of this size just stays within the travel."""
    return rig.speed_m_s * size / (2.0 * math.pi * TRAVEL * rig.stroke_m)


def _multisine(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, size: float, small: bool
) -> FloatArray:
    """Multisine of the speed: odd multiples of a base frequency, flat spectrum, random phases."""
    low = max(0.15, 0.5 * _lowest_hz(rig, size))
    high = min(1.5 if small else spread(rng, 4.0, 14.0), 0.2 / dt_s)
    count = 6 if small else int(rng.integers(10, 25))
    base = 1.0 / float(rng.choice([5.0, 10.0]))
    tones = np.unique(np.rint(np.geomspace(low, max(high, 2.0 * low), count) / base / 2.0)) * 2 + 1
    time = dt_s * np.arange(samples)
    phases = rng.uniform(0.0, 2.0 * math.pi, tones.size)
    wave = np.sin(2.0 * math.pi * base * np.outer(time, tones) + phases).sum(axis=1)
    return np.asarray(size * wave / np.abs(wave).max())


def _triangle(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, size: float, small: bool
) -> FloatArray:
    """Slow motion back and forth; the speed is drawn anew after every four strokes."""
    relative_speed = np.empty(samples)
    k = 0
    direction = float(rng.choice([-1.0, 1.0]))
    while k < samples:
        speed = (0.3 if not small else 0.6) * size * float(rng.uniform(0.15, 1.0))
        half = int(rng.uniform(0.5, 2.0) / dt_s)
        for _ in range(4):
            relative_speed[k : k + half] = direction * speed
            direction = -direction
            k += half
    return relative_speed


def _chirp(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, size: float, small: bool
) -> FloatArray:
    """Sine sweep whose frequency rises exponentially with time."""
    low = max(0.2, 1.1 * _lowest_hz(rig, size))
    high = min(1.5 if small else spread(rng, 5.0, 15.0), 0.2 / dt_s)
    high = max(high, 2.0 * low)
    share = np.arange(samples) / samples
    rise = math.log(high / low)
    phase = 2.0 * math.pi * low * samples * dt_s / rise * np.expm1(rise * share)
    return np.asarray(size * np.sin(phase + rng.uniform(0.0, 2.0 * math.pi)))


def _prbs(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, size: float, small: bool
) -> FloatArray:
    """Random binary sequence; its amplitude is drawn anew after every 20 clock periods."""
    clock = max(int(rng.uniform(0.03, 0.1) / dt_s), 1) * (8 if small else 1)
    count = samples // clock + 1
    signs = rng.choice([-1.0, 1.0], count)
    # Every second bit has the opposite sign of the bit before, so the rod stays near its start.
    signs[1::2] = -signs[: 2 * (count // 2) : 2]
    levels = np.repeat(rng.uniform(0.2, 1.0, count // 20 + 1), 20)[:count]
    # Instant reversals at full command would pull the rod side empty; no operator drives so.
    return np.asarray(np.repeat(0.7 * size * signs * levels, clock)[:samples])


def _steps(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, largest: float
) -> FloatArray:
    """Levels, m, each held for 0.3 to 1.6 s; a step is at most `largest`, m.

    A larger step is more than the controller can command.
    """
    travel = TRAVEL * rig.stroke_m
    level, k = 0.0, 0
    out = np.empty(samples)
    while k < samples:
        step = largest * float(rng.uniform(0.1, 1.0)) * float(rng.choice([-1.0, 1.0]))
        if abs(level + step) > travel:
            step = -step
        level = float(np.clip(level + step, -travel, travel))
        hold = int(rng.uniform(0.3, 1.6) / dt_s)
        out[k : k + hold] = level
        k += hold
    return out
