# SPDX-License-Identifier: MIT
"""Excitation of a position servo: the motions that an experimenter would command.

Nothing here depends on an effect; amplitudes follow from the values in the rig file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from ehsid.harness.base.arrays import FloatArray

from .movements import MOVEMENTS, Movement, draw_movement
from .nominal_rig import NominalRig, spread

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
