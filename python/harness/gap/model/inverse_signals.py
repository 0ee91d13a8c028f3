# SPDX-License-Identifier: MIT
"""Measured signals of a record, prepared for the equations of the servo."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import cont2discrete, lfilter, savgol_filter, ss2tf, tf2ss

from ehsid import EffectTerms
from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.gap.thresholds import EQUATIONS_DT_S
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import command_limit
from ehsid.harness.simulation.windows import SMOOTHED_S

Values = Mapping[str, float]

# Terms of an equation by name, shape (K,) each. Their sum is the residual of the equation.
Terms = dict[str, FloatArray]

ATMOSPHERE_PA = 101325.0

# Number of cached results of functions that filter a whole signal: most values do not change them.
CACHE_SIZE = 16


@dataclass(frozen=True, eq=False)
class Measured:
    """Signals of a record, shape (N,) each.

    Attributes
    ----------
    dt_s
        sampling time, s.
    command
        command as a fraction of the rated command; in V for an axis.
    columns
        measured columns by name.
    """

    dt_s: float
    command: FloatArray
    columns: Mapping[str, FloatArray]


def measured(record: Record, rig: Rig) -> Measured:
    """Returns the signals of a record; every n-th sample if it is faster than EQUATIONS_DT_S.

    Raises
    ------
    ValueError
        the record has gaps or no sampling time.
    """
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(
            f"{record.source or record.name}: the equations need one stretch with a sampling time; "
            "cut the record at its gaps"
        )
    limit = command_limit(rig)
    command = record.column("command_v") / (limit if math.isfinite(limit) else 1.0)
    stride = max(1, round(EQUATIONS_DT_S / record.dt_s))
    count = len(record) // stride
    # The command is held from sample to sample. Over n samples its mean acts on the servo.
    held = command[: count * stride].reshape(count, stride).mean(axis=1)
    columns = {name: column[: count * stride : stride] for name, column in record.columns.items()}
    return Measured(stride * record.dt_s, held, columns)


def all_values(rig: Rig, values: Values) -> dict[str, float]:
    """Returns all values of the plant by full name.

    Given values replace those of the rig file. Without either, effects are off and other values are
    typical ones.
    """
    plant_values = rig.plant_values(values)
    return dict(zip(plant_parameters(), plant_values.tolist(), strict=True))


def areas(values: Values) -> tuple[float, float]:
    """Areas of the piston on the cap side and on the rod side, m^2."""
    cap = 0.25 * math.pi * values["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * values["cylinder.rod_m"] ** 2


def speed_of(signals: Measured) -> FloatArray:
    """Speed of the rod, m/s: the slope of parabolas fitted to the measured position, shape (N,)."""
    return smoothed(signals, 1)


@lru_cache(maxsize=CACHE_SIZE)
def smoothed(signals: Measured, order: int) -> FloatArray:
    """Smoothed position, m (order 0), or its slope, m/s (order 1), shape (N,).

    Parabolas are fitted to the measured position over SMOOTHED_S (Savitzky, Golay 1964).
    """
    length = max(5, 2 * round(0.5 * SMOOTHED_S / signals.dt_s) + 1)
    position = signals.columns["position_m"]
    return np.asarray(savgol_filter(position, length, polyorder=2, deriv=order, delta=signals.dt_s))


def filtered(
    signal: FloatArray, numerator: FloatArray, denominator: FloatArray, dt_s: float
) -> FloatArray:
    """Signal behind a system of gain one, by its polynomials in s; from rest, shape (N,).

    The signal runs straight from sample to sample.
    """
    a, b, c, d, _ = cont2discrete(tf2ss(numerator, denominator), dt_s, "foh")
    forward, back = ss2tf(a, b, c, d)
    return np.asarray(signal[0] + lfilter(forward[0], back, signal - signal[0]), dtype=np.float64)


@lru_cache(maxsize=CACHE_SIZE)
def last_direction(signals: Measured, distance: float) -> FloatArray:
    """Direction of the last motion of the rod, in [-1, 1], shape (N,), see `motion_direction`."""
    return motion_direction(smoothed(signals, 0), distance)


def terms_of(values: Values) -> EffectTerms:
    """Terms that the effects add to the equations, at all values of the plant by full name."""
    return EffectTerms([values[name] for name in plant_parameters()])


def true_position(signals: Measured, values: Values) -> FloatArray:
    """Position, m, with lag, uneven scale and play of its sensor undone; quantisation remains."""
    position = signals.columns["position_m"]
    terms = terms_of(values)
    lag, half_width = terms.sensor_error
    if lag > 0.0:
        position = position + lag * speed_of(signals)
    position = terms.position_of(position)
    if half_width > 0.0:
        # The last motion determines which side of the play is in contact.
        position = position + half_width * last_direction(signals, 0.2 * half_width)
    return position


def motion_direction(position: FloatArray, distance: float) -> FloatArray:
    """Direction s of the last motion, in [-1, 1]: s' = (v - |v| s) / distance (Dahl 1968).

    It is 0 at the start. It approaches +-1 as the motion exceeds `distance`, m.
    """
    increments = np.diff(position, prepend=position[0])
    signs = np.sign(increments).tolist()
    decays = np.exp(-np.abs(increments) / distance).tolist()
    direction, directions = 0.0, []
    for sign, decay in zip(signs, decays, strict=True):
        direction = sign + (direction - sign) * decay
        directions.append(direction)
    return np.array(directions)
