# SPDX-License-Identifier: MIT
"""What a record measured, as the equations of the servo take it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import savgol_filter

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.thresholds import EQUATIONS_DT_S
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import plant_parameters
from ehsid.harness.simulation import command_limit
from ehsid.harness.simulation.windows import SMOOTHED_S

Values = Mapping[str, float]

# Terms of an equation, shape (K,) each; they add up to its residual.
Terms = dict[str, FloatArray]

ATMOSPHERE_PA = 101325.0

# What loops over samples is kept for this many records or sizes: most values do not touch it.
KEPT = 16


@dataclass(frozen=True, eq=False)
class Measured:
    """Signals of a record, shape (N,) each.

    Attributes
    ----------
    dt_s
        sampling time.
    command
        fraction of rated; V for an axis.
    columns
        measured columns by name.
    """

    dt_s: float
    command: FloatArray
    columns: Mapping[str, FloatArray]


def measured(record: Record, rig: Rig) -> Measured:
    """What the equations need; of samples closer than a millisecond every n-th only.

    Raises
    ------
    ValueError
        a record with gaps or without sampling time.
    """
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(
            f"{record.source or record.name}: the equations need one stretch with a sampling time; "
            "cut the record at its gaps"
        )
    limit = command_limit(rig)
    command = record.column("command_v") / (limit if math.isfinite(limit) else 1.0)
    every = max(1, round(EQUATIONS_DT_S / record.dt_s))
    count = len(record) // every
    # The command is held: over n samples it acts by its mean.
    held = command[: count * every].reshape(count, every).mean(axis=1)
    columns = {name: column[: count * every : every] for name, column in record.columns.items()}
    return Measured(every * record.dt_s, held, columns)


def all_values(rig: Rig, values: Values) -> dict[str, float]:
    """By full name, all of the plant: those given, of the rig, typical; effects else off."""
    numbers = rig.plant_values(values)
    return dict(zip(plant_parameters(), numbers.tolist(), strict=True))


def areas(values: Values) -> tuple[float, float]:
    """Of the piston, cap side and rod side, m^2."""
    cap = 0.25 * math.pi * values["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * values["cylinder.rod_m"] ** 2


def speed_of(signals: Measured) -> FloatArray:
    """Slope of a parabola fitted to the measured position over 20 ms, m/s."""
    return smoothed(signals, 1)


@lru_cache(maxsize=KEPT)
def smoothed(signals: Measured, order: int) -> FloatArray:
    """Position, order 0, or its slope, from parabolas over 20 ms (Savitzky, Golay 1964)."""
    length = max(5, 2 * round(0.5 * SMOOTHED_S / signals.dt_s) + 1)
    position = signals.columns["position_m"]
    return np.asarray(savgol_filter(position, length, polyorder=2, deriv=order, delta=signals.dt_s))


@lru_cache(maxsize=KEPT)
def side(signals: Measured, distance: float) -> FloatArray:
    """Of the last motion of the rod, see `bend`."""
    return bend(smoothed(signals, 0), distance)


def true_position(signals: Measured, values: Values) -> FloatArray:
    """What the sensor would show without its effects: lag, then play, undone; steps cannot be."""
    position = signals.columns["position_m"]
    lag = values["effects.sensor_lag.time_constant_s"]
    if lag > 0.0:
        position = position + lag * speed_of(signals)
    half_width = values["effects.sensor_backlash.half_width_m"]
    if half_width > 0.0:
        # The side of the play that touches: that of the last motion.
        position = position + half_width * side(signals, 0.2 * half_width)
    return position


def bend(position: FloatArray, distance: float) -> FloatArray:
    """Side of the last motion: s' = (v - |v| s) / distance, from 0 to +-1 (Dahl 1968)."""
    moves = np.diff(position, prepend=position[0])
    ways = np.sign(moves).tolist()
    decays = np.exp(-np.abs(moves) / distance).tolist()
    state, found = 0.0, []
    for way, decay in zip(ways, decays, strict=True):
        state = way + (state - way) * decay
        found.append(state)
    return np.array(found)
