# SPDX-License-Identifier: MIT
"""What the force balance of a record says about the mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION
from ..diagnosis.data.gate_signs import BLOCKS, jackknife
from ..diagnosis.data.sensor_floor import sensor_floor
from ..records import Record
from ..rigs import Rig
from .motion import Areas
from .smooth import Kernel, kernel

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
