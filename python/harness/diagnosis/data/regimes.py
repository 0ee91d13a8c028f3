# SPDX-License-Identifier: MIT
"""Regimes that a record visits; it has no information on effects in other regimes.

Bootstrap over whole windows (H. R. Künsch, Ann. Statist. 17(3), 1989).

Errors within a window are correlated, those of different windows hardly: windows are drawn with
replacement, each with all its samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...records import Record
from ...rigs import Rig
from ...signals.simulation import command_limit, measured_states
from .floor import sensor_floor

# The command is near null below this share of the rated command. There overlap, leakage and null
# bias act; the value is a few times the overlap of a servo valve.
NEAR_NULL = 0.05
# The command rests while it stays within this share of the rated command for this time: steps that
# are held, and ramps of half the rated command a second. There a spool sticks.
REST_WIDTH = 0.05
REST_S = 0.1
# Motion is slow below this share of the largest speed. There viscous forces do not hide friction.
SLOW_SHARE = 0.05


@dataclass(frozen=True)
class Regimes:
    """Regimes that a record visits, as shares of its time unless stated otherwise."""

    largest_command: float
    """Fraction of the rated command, or of the record's own largest if the drive has no limit."""
    near_null: float
    """Time with commands below NEAR_NULL of the rated command."""
    resting: float
    """Time at the end of REST_S with commands within REST_WIDTH of the rated command."""
    slow: float
    """Time with speeds below SLOW_SHARE of the largest speed."""
    command_reversals: int
    motion_reversals: int
    """Numbers of reversals of the command and of the rod, by more than 5 and 2 % of their range."""
    travel: float | None
    """Share of the stroke that the rod covers; None without a stroke."""
    at_ends: float | None
    """Time within a hundredth of the stroke from either end; None without a stroke."""
    load_signs: int | None
    """1 or 2: number of directions in which the load force acts; None without pressures."""
    fast_power_hz: float
    """Frequency below which 99 % of the power of the command's changes lies, Hz."""
    lowest_pressure_pa: float | None
    highest_pressure_pa: float | None
    """Lowest and highest pressure of both chambers, Pa; None without pressures."""
    highest_of_supply: float | None
    lowest_of_tank: float | None
    """The same as shares of the supply pressure and of the tank pressure of the rig."""
    positions_m: tuple[float, float]
    """Lowest and highest position, m."""
    position_floor_m: float
    """Noise floor of the position sensor, its steps included, m."""
    seconds: float
    """Length of the record, s."""


def reversals(signal: FloatArray, share: float) -> int:
    """Counts the reversals of a signal that exceed this share of its range (zigzag)."""
    least = share * float(np.ptp(signal))
    if least <= 0.0:
        return 0
    turns, direction = 0, 0
    low = high = float(signal[0])
    for value in signal.tolist():
        low, high = min(low, value), max(high, value)
        if direction <= 0 and value - low > least:
            turns += direction < 0
            direction, high = 1, value
        elif direction >= 0 and high - value > least:
            turns += direction > 0
            direction, low = -1, value
    return turns


def visited(record: Record, rig: Rig) -> Regimes:
    """Determines the regimes that a record without gaps visits.

    Raises
    ------
    ValueError
        the record has gaps, or no sampling time.
    """
    states = measured_states(record)
    assert record.dt_s is not None
    command, position, speed = record.column("command_v"), states[:, 0], states[:, 1]
    limit = command_limit(rig)
    rated = limit if np.isfinite(limit) else float(np.abs(command).max())
    share = np.abs(command) / max(rated, 1e-300)
    stroke = rig.values.get("cylinder.stroke_m")
    travel = at_ends = None
    if stroke is not None:
        travel = float(np.ptp(position) / stroke)
        end = 0.01 * stroke
        at_ends = float(np.mean((position < end) | (position > stroke - end)))
    load_signs = lowest = highest = of_supply = of_tank = None
    if not np.isnan(states[:, 2:]).any() and "cylinder.bore_m" in rig.values:
        cap = rig.values["cylinder.bore_m"] ** 2
        annulus = cap - rig.values["cylinder.rod_m"] ** 2
        load = states[:, 2] * cap - states[:, 3] * annulus
        # The load acts in both directions if it acts in each for more than a twentieth of the time.
        load_signs = 2 if 0.05 < float(np.mean(load > 0.0)) < 0.95 else 1
        # Quantiles keep noise out of the extremes: a thousandth of the samples exceeds each.
        lowest, highest = (float(end) for end in np.quantile(states[:, 2:], [0.001, 0.999]))
        of_supply = highest / rig.values["supply.pressure_pa"]
        of_tank = lowest / rig.values["supply.tank_pressure_pa"]
    return Regimes(
        largest_command=float(share.max()),
        near_null=float(np.mean(share < NEAR_NULL)),
        resting=_resting(command / max(rated, 1e-300), record.dt_s),
        slow=float(np.mean(np.abs(speed) < SLOW_SHARE * np.abs(speed).max())),
        command_reversals=reversals(command, 0.05),
        motion_reversals=reversals(position, 0.02),
        travel=travel,
        at_ends=at_ends,
        load_signs=load_signs,
        fast_power_hz=_fast_power(command, record.dt_s),
        lowest_pressure_pa=lowest,
        highest_pressure_pa=highest,
        highest_of_supply=of_supply,
        lowest_of_tank=of_tank,
        positions_m=(float(position.min()), float(position.max())),
        position_floor_m=sensor_floor(record, "position_m", rig).value,
        seconds=len(record) * record.dt_s,
    )


def _resting(command: FloatArray, dt_s: float) -> float:
    """Share of the samples before which the command, a fraction of rated, has rested."""
    samples = max(1, round(REST_S / dt_s)) + 1
    if command.size < samples:
        return 0.0
    widths = np.ptp(np.lib.stride_tricks.sliding_window_view(command, samples), axis=1)
    return float(np.count_nonzero(widths <= REST_WIDTH) / command.size)


def _fast_power(command: FloatArray, dt_s: float) -> float:
    """Frequency below which 99 % of the power of the command's changes lies, Hz.

    The changes from sample to sample are used, so that a step counts as what it excites.
    """
    power = np.abs(np.fft.rfft(np.diff(command))) ** 2
    if power.sum() <= 0.0:
        return 0.0
    index = int(np.searchsorted(np.cumsum(power), 0.99 * power.sum()))
    return index / ((command.size - 1) * dt_s)


# Confidence intervals of the shrinkage. The contract fixes their level; the number of bootstrap
# draws gives the ends a second digit.
SHRINKAGE_LEVEL = 0.9
BOOTSTRAP_DRAWS = 500
BOOTSTRAP_SEED = 20261121


def drawn_windows(windows: int, seed: int = BOOTSTRAP_SEED) -> npt.NDArray[np.int64]:
    """Returns the numbers of the windows in each draw, shape (BOOTSTRAP_DRAWS, windows)."""
    return np.random.default_rng(seed).integers(windows, size=(BOOTSTRAP_DRAWS, windows))


def interval(draws: FloatArray) -> tuple[float, float]:
    """Returns the interval of level SHRINKAGE_LEVEL of the values of all draws; NaN is left out."""
    tail = 0.5 * (1.0 - SHRINKAGE_LEVEL)
    low, high = np.nanquantile(draws, [tail, 1.0 - tail])
    return float(low), float(high)
