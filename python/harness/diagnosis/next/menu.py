# SPDX-License-Identifier: MIT
"""Menu of experiments, each for some regime, inside the limits of a machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base.numbers import FloatArray
from ...records import Record
from ...rigs import Rig
from ...signals.excitation import chirp, multisine, random_steps, triangle
from ...signals.simulation import (
    SimulationError,
    simulate_closed_loop,
    suggested_controller,
    velocity_gain,
)

# Duration of an experiment, s: long enough for fifteen windows, and short enough to run several of
# them in an afternoon.
DESIGN_S = 8.0
# Upper end of the excited band: above the corner frequency of any servo valve whose lag matters.
DESIGN_FAST_HZ = 150.0
# Bandwidth of the loop that holds the rod about its path. It leaves the command unchanged above a
# few times this frequency.
DESIGN_HELD_HZ = 0.2
# Share of the span that stays free at either end. Half of it is for what the rig file does not
# tell.
DESIGN_MARGIN = 0.1
# Chamber pressures may exceed the supply pressure through inertia and unequal areas. Above this
# multiple of it, relief valves open.
DESIGN_PRESSURE = 1.5
# Below half an atmosphere oil foams, which harms the machine, and no simulator is accurate there.
DESIGN_VACUUM_PA = 5e4

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


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment with the outputs that the best candidate predicts."""

    description: str
    """One line for the operator."""
    record: Record
    """Command and all outputs of the plant, without noise."""


def _triangle(period_s: float, n: int, dt_s: float) -> FloatArray:
    return triangle(n, dt_s, amplitude=1.0, period_s=period_s)


def _steps(hold_s: tuple[float, float], n: int, dt_s: float) -> FloatArray:
    hold = round(hold_s[0] / dt_s), round(hold_s[1] / dt_s)
    rng = np.random.default_rng(SEED)
    return random_steps(n, amplitude=1.0, hold=hold, rng=rng)


def _multisine(low_hz: float, n: int, dt_s: float) -> FloatArray:
    band = low_hz, min(DESIGN_FAST_HZ, 0.4 / dt_s)
    return multisine(n, dt_s, band_hz=band, peak=1.0, rng=np.random.default_rng(SEED))


def _chirp(n: int, dt_s: float) -> FloatArray:
    return chirp(n, dt_s, amplitude=1.0, band_hz=(1.0, min(DESIGN_FAST_HZ, 0.4 / dt_s)))


def _away_from_null(n: int, dt_s: float) -> FloatArray:
    """Forward and back at a steady speed, with a small triangle on it; shape (n,)."""
    slow = np.sign(np.sin(2.0 * np.pi * 0.5 * np.arange(n) * dt_s))
    return np.asarray(0.85 * slow + 0.15 * triangle(n, dt_s, amplitude=1.0, period_s=0.25))


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
    return np.concatenate([shape - shape.mean() for shape in shapes])


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


def simulate_experiment(
    entry: Entry,
    rig: Rig,
    values: dict[str, float],
    *,
    dt_s: float,
    limit_v: float,
    span_m: tuple[float, float],
) -> Experiment | None:
    """Simulates an excitation on a machine; returns None if it would leave the limits.

    Because a servo drifts, a slow position loop holds the rod about its path. The command that this
    loop puts out is the command of the experiment.

    Parameters
    ----------
    entry
        entry of the menu.
    rig
        the machine.
    values
        values of the best candidate, by full name.
    dt_s
        sampling time, s.
    limit_v
        largest command, V.
    span_m
        smallest and largest position of the rod, m.
    """
    n = round(DESIGN_S / dt_s)
    shape = entry.shape(n, dt_s)
    command = entry.size * limit_v * (shape - shape.mean())
    # Path of a plant whose speed follows the command. It ends where it began.
    path = velocity_gain(rig) * dt_s * np.cumsum(command)
    room = (1.0 - 2.0 * DESIGN_MARGIN) * (span_m[1] - span_m[0])
    scale = min(1.0, room / max(float(np.ptp(path)), 1e-12))
    path = 0.5 * (span_m[0] + span_m[1]) + scale * (path - 0.5 * (path.max() + path.min()))
    controller = replace(suggested_controller(rig, DESIGN_HELD_HZ), limit_v=limit_v)
    try:
        run = simulate_closed_loop(rig, path, controller, dt_s=dt_s, values=values)
    except SimulationError:
        return None
    record = run.run.record
    position = record.column("position_m")
    # The other half of the margin is for errors of the candidate.
    edge = 0.5 * DESIGN_MARGIN * (span_m[1] - span_m[0])
    if position.min() < span_m[0] + edge or position.max() > span_m[1] - edge:
        return None
    if rig.plant == "ehs":
        chambers = np.stack([record.column(name) for name in ("pressure_a_pa", "pressure_b_pa")])
        largest_pressure = DESIGN_PRESSURE * rig.values["supply.pressure_pa"]
        if chambers.max() > largest_pressure or chambers.min() < DESIGN_VACUUM_PA:
            return None
    size = scale * entry.size
    speed = 1e3 * velocity_gain(rig) * size * limit_v
    return Experiment(entry.description.format(speed=speed, size=100.0 * size), record)
