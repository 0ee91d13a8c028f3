# SPDX-License-Identifier: MIT
"""Gate for values: possible on this rig, and in the units of the schema.

Gate for the time of a record: even sampling, fine sampling, sufficient length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from ...catalogue.channels import CHAMBER_PRESSURES, CHANNELS, SUPPLY_PRESSURE
from ...records import Record
from ...records.checks import mend_of_gaps, pieces_in_words
from ...records.mapping import how_to_read
from ...rigs import Rig
from ...rigs.rig import MOST_SIGMAS
from ..schema import SKIP_S, WINDOW_S, Remark
from .floor import LEAST_SAMPLES, noise_floor, shows_motion
from .repeats import full_speed, oil_spring_hz

# Within a hundredth of the stroke from an end, the rod counts as at that end. A mean shows a
# twentieth of the time spent there; with half of the time there, the record cannot be used.
END_ZONE = 0.01
AT_END = 0.05
AT_END_ALL = 0.5
# Positions beyond the stroke: by a hundredth it is the zero error of a sensor, by a tenth it is
# another machine or another unit.
BEYOND = 0.01
STROKE_BEYOND = 0.1
# Speeds fit a unit of length within a factor of three, which load, friction and a rough rated flow
# take; neighbouring units differ by ten. They are taken over a time in which noise hardly counts.
SPEED_FITS = 3.0
SPEED_OVER_S = 0.05
# Commands beyond the rated command: by a hundredth it is the zero error of the amplifier; three
# times the rated command is another unit. LIMIT_SHARE is the share of the time at the limit that
# the gate reports.
COMMAND_BEYOND = 0.01
COMMAND_UNIT = 3.0
LIMIT_SHARE = 0.2
# Pressures that never reach a hundredth of the supply pressure are in another unit. In kPa, the
# closest one, and in psi the numbers are a thousandth and less of those in Pa. The tank pressure
# alone is more than a hundredth.
PRESSURE_UNIT = 0.01
# Absolute pressures below zero by this many noise floors are not noise: white noise of 400,000
# samples stays within five standard deviations.
VACUUM_FLOORS = 6.0
# Share of the time for which a chamber pressure may exceed what the supply can give: water hammer
# is over in a hundredth of the time.
BEYOND_SHARE = 0.01

# Units that logs use, each with its size in the unit of the schema.
LENGTHS = MappingProxyType({"cm": 1e-2, "mm": 1e-3, "um": 1e-6})
PRESSURES = MappingProxyType({"kPa": 1e3, "psi": 6894.757, "bar": 1e5, "MPa": 1e6})
ATMOSPHERE_PA = 101325.0
OTHER_UNIT = "perhaps it is in another unit"


def _nearest(scale: float, units: Mapping[str, float]) -> str | None:
    """Returns the unit whose scale is nearest; None if none is within a factor of three."""
    unit = min(units, key=lambda name: abs(math.log(units[name] / scale)))
    return unit if abs(math.log(units[unit] / scale)) < math.log(3.0) else None


def check_command(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks whether the command exceeds the rated command, or is at it for a long time."""
    beyond = beyond_rated(record, rig)
    if beyond is not None:
        yield beyond
        return
    rated = rig.values.get("valve.rated_command_v", math.inf)
    size = np.abs(record.column("command_v"))
    time_at_limit = float(np.mean(size > (1.0 - COMMAND_BEYOND) * rated))
    if time_at_limit > LIMIT_SHARE:
        yield Remark(
            record.name,
            f"the command is at its limit for {100.0 * time_at_limit:.0f} % of the time: there "
            "it says little; take a smaller reference",
        )


def beyond_rated(record: Record, rig: Rig) -> Remark | None:
    """Returns what is to be said of a command beyond the rated one; None where it is not."""
    rated = rig.values.get("valve.rated_command_v")
    if rated is None:
        return None
    size = np.abs(record.column("command_v"))
    largest = float(size.max())
    if largest > COMMAND_UNIT * rated:
        return Remark(
            record.name,
            f"command_v goes up to {largest:.3g}, but {rated:g} V is the full opening: the "
            "unit is wrong, or valve.rated_command_v of the rig; with per cent, rated is 100",
            serious=True,
        )
    time_above = float(np.mean(size > (1.0 + COMMAND_BEYOND) * rated))
    if time_above == 0.0:
        return None
    return Remark(
        record.name,
        f"command_v is beyond the rated {rated:g} V for {100.0 * time_above:.2g} % of the "
        f"time (up to {largest:.3g} V): valves do not open further, the simulated one "
        "does; check valve.rated_command_v",
    )


def check_position(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that the position is in metres, within the stroke, and mostly away from its ends."""
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is None:
        return
    beyond = beyond_stroke(record, rig)
    if beyond is not None:
        yield beyond
        if beyond.serious:
            return
    position = record.column("position_m")
    zone = END_ZONE * stroke
    at_ends = float(np.mean((position < zone) | (position > stroke - zone)))
    if at_ends > AT_END:
        yield Remark(
            record.name,
            f"the rod is at an end of its stroke for {100.0 * at_ends:.2g} % of the time: "
            "stops are not compared fairly; keep away from them",
            serious=at_ends > AT_END_ALL,
        )


def beyond_stroke(record: Record, rig: Rig) -> Remark | None:
    """Returns what is to be said of positions beyond the stroke; None where there are none.

    It is serious where they are so far away that the unit or the machine is another one.
    """
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is None:
        return None
    position = record.column("position_m")
    low, high = float(position.min()), float(position.max())
    excess = max(-low, high - stroke) / stroke
    if excess > STROKE_BEYOND:
        unit = _length_unit(record, rig, max(-low, high))
        if -low > 0.0 and high - low <= 1.01 * stroke:
            remedy = "it is not counted from the cap end: add what is missing to the column"
        elif unit is not None:
            remedy = f"{OTHER_UNIT}: {how_to_read(record, rig.columns, 'position_m', unit)}"
        else:
            remedy = (
                "cylinder.stroke_m of the rig file is too short, or the unit of the column is wrong"
            )
        return Remark(
            record.name,
            f"position_m runs from {low:.4g} to {high:.4g}, the stroke from 0 to {stroke:g} m; "
            f"{remedy}",
            serious=True,
        )
    if excess > BEYOND:
        return Remark(
            record.name,
            f"the rod is {1e3 * excess * stroke:.2g} mm beyond an end of the stroke of "
            f"{stroke:g} m: check the sensor's zero and cylinder.stroke_m",
        )
    return None


def _length_unit(record: Record, rig: Rig, farthest: float) -> str | None:
    """Returns the unit in which both the range and the speeds of the position fit the rig, or None.

    `farthest` is the largest distance from zero, as the column has it.
    """
    share = _speed_share(record, rig)
    stroke = rig.values["cylinder.stroke_m"]
    fitting = [
        name
        for name, size in LENGTHS.items()
        if farthest * size <= 1.01 * stroke and 1.0 / SPEED_FITS <= share * size <= SPEED_FITS
    ]
    return fitting[0] if len(fitting) == 1 else None


def _speed_share(record: Record, rig: Rig) -> float:
    """Speeds of the position over those that the valve gives without load, rms; NaN if unknown."""
    values, dt_s = rig.values, record.dt_s
    if dt_s is None or rig.plant != "ehs":
        return math.nan
    step = max(round(SPEED_OVER_S / dt_s), 1)
    position, command = record.column("position_m"), record.column("command_v")
    if position.size <= step:
        return math.nan
    speed = (position[step:] - position[:-step]) / (step * dt_s)
    opening = np.clip(command / values["valve.rated_command_v"], -1.0, 1.0)
    expected = full_speed(values) * float(np.sqrt(np.mean(opening**2)))
    return float(np.sqrt(np.mean(speed**2))) / expected if expected > 0.0 else math.nan


def check_pressures(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that pressures are in Pa, absolute, above vacuum, and possible with the supply."""
    supply = rig.values.get("supply.pressure_pa")
    if supply is not None:
        for name in (*CHAMBER_PRESSURES, SUPPLY_PRESSURE):
            if name in record.columns:
                yield from _pressure(record, rig, name, supply)


def check_supply(record: Record, rig: Rig) -> Iterator[Remark]:
    """Compares a measured supply with the rig, where the units of all pressures are right."""
    supply = rig.values.get("supply.pressure_pa")
    if supply is None or SUPPLY_PRESSURE not in record.columns:
        return
    if any(remark.serious for remark in check_pressures(record, rig)):
        return
    measured = float(np.median(record.column(SUPPLY_PRESSURE)))
    deviation = measured / supply - 1.0
    if abs(deviation) > MOST_SIGMAS * rig.sigma("supply.pressure_pa"):
        yield Remark(
            record.name,
            f"the supply is measured at {measured:.4g} Pa, the rig says {supply:.4g} Pa "
            f"({100.0 * deviation:+.0f} %), beyond its uncertainty; correct supply.pressure_pa",
        )


def _pressure(record: Record, rig: Rig, name: str, supply: float) -> Iterator[Remark]:
    pressure = record.column(name)
    low, top = float(pressure.min()), float(np.quantile(pressure, 0.99))
    if top < PRESSURE_UNIT * supply:
        # The largest pressure in a chamber is some 70 % of the supply pressure.
        expected = supply if name == SUPPLY_PRESSURE else 0.7 * supply
        unit = _nearest(expected / top, PRESSURES) if top > 0.0 else None
        remedy = (
            f"{OTHER_UNIT}: {how_to_read(record, rig.columns, name, unit)}"
            if unit
            else "check the sensor and the unit"
        )
        yield Remark(
            record.name,
            f"{name} goes up to {top:.3g} Pa, the supply has {supply:.3g} Pa; {remedy}",
            serious=True,
        )
        return
    # Noise also makes values below zero where the oil is near vacuum.
    if low < -VACUUM_FLOORS * noise_floor(pressure).value:
        gauge = low > -1.05 * ATMOSPHERE_PA
        remedy = (
            "the sensor shows pressure above the atmosphere: add 101325 Pa"
            if gauge
            else "check the sensor's zero and sign"
        )
        yield Remark(
            record.name,
            f"{name} goes down to {low:.3g} Pa, absolute pressure cannot; {remedy}",
            serious=not gauge,
        )
    if "cylinder.bore_m" not in rig.values:
        return  # of a user's simulator, whose areas the rig file does not tell
    # A pulling load can raise the pressure of one chamber above the supply pressure: at standstill,
    # by the ratio of the areas at most.
    ratio = LARGEST_RATIO
    if "cylinder.bore_m" in rig.values:
        bore, rod = rig.values["cylinder.bore_m"], rig.values["cylinder.rod_m"]
        ratio = bore**2 / (bore**2 - rod**2)
    largest_possible = supply * (1.0 if name != "pressure_b_pa" else ratio)
    time_above = float(
        np.mean(pressure > (1.0 + MOST_SIGMAS * rig.sigma("supply.pressure_pa")) * largest_possible)
    )
    if time_above > BEYOND_SHARE and name in CHAMBER_PRESSURES:
        yield Remark(
            record.name,
            f"{name} is above what a supply of {supply:.4g} Pa gives for "
            f"{100.0 * time_above:.2g} % of the time; check the sensor's range and "
            "supply.pressure_pa",
        )


# Of the areas of a common cylinder, where a rig file does not tell them.
LARGEST_RATIO = 2.0

# Jitter, as a share of the sampling time: a tenth of what the reader of records refuses. A sine of
# 10 Hz at 1 kHz is then wrong by 6e-5 of its amplitude.
JITTER_SHOWS = 1e-3
# A quartz clock keeps its rate to 1e-4. A sampling time that changes by more was not made by one.
CLOCK_DRIFT = 2e-4
# Smallest number of windows in a record: two to fit and two to hold out.
LEAST_WINDOWS = 4
# With fewer than ten samples per period, the held command with its delay of half a sample hides a
# lag.
SAMPLES_A_PERIOD = 10

# Number of parts of a record whose sampling times are compared.
PARTS = 10


def check_clock(record: Record) -> Iterator[Remark]:
    """Checks that the record has a time, and looks for jitter, drift and gaps in it."""
    if record.time_s is None or record.dt_s is None or record.jitter is None:
        yield Remark(
            record.name,
            "there is no column 'time_s': without the sampling time nothing can be simulated; "
            "add it, in seconds",
            serious=True,
        )
        return
    if record.jitter.rms_relative > JITTER_SHOWS:
        yield Remark(
            record.name,
            f"the time between samples wavers by {100.0 * record.jitter.rms_relative:.2g} % "
            f"(at most {100.0 * record.jitter.max_relative:.2g} %, at row "
            f"{record.jitter.worst_row}); the simulation takes it as even, fast motion looks "
            "noisier than it was",
        )
    if record.gaps:
        longest = max(record.gaps, key=lambda gap: gap.duration_s)
        yield Remark(
            record.name,
            f"samples are missing at {len(record.gaps)} places, the longest for "
            f"{longest.duration_s:.3g} s after {longest.start_s:.4g} s; the parts between are "
            "taken one by one, those too short are left out",
        )
    else:
        yield from _drift(record)


def _drift(record: Record) -> Iterator[Remark]:
    """Checks whether sampling times of parts of the record differ by more than jitter explains."""
    assert record.time_s is not None
    assert record.dt_s is not None
    assert record.jitter is not None
    edges = np.linspace(0, len(record) - 1, PARTS + 1).astype(int)
    if len(record) < 10 * PARTS:
        return
    sampling_times = np.diff(record.time_s[edges]) / np.diff(edges)
    spread = float(np.ptp(sampling_times) / record.dt_s)
    # Each end of a part is uncertain by the jitter of a single sample.
    by_jitter = 4.0 * record.jitter.max_relative / float(np.diff(edges).min())
    if spread <= max(CLOCK_DRIFT, by_jitter):
        return
    yield Remark(
        record.name,
        f"the clock drifts: the sampling time changes by {100.0 * spread:.2g} % over the "
        "record; resample it on an even clock",
    )


def check_length(record: Record, whole: Record) -> Iterator[Remark]:
    """Checks that the longest part of the `whole` record can fit windows and hold others out."""
    assert record.dt_s is not None
    seconds = len(record) * record.dt_s
    needed = SKIP_S + LEAST_WINDOWS * WINDOW_S
    if seconds < needed * (1.0 - 1e-9):
        yield Remark(
            record.name,
            f"{seconds:.3g} s without a gap are too short: the diagnosis needs {needed:g} s, "
            f"the first {SKIP_S:g} s and {LEAST_WINDOWS} windows; "
            f"{longer(whole, needed / record.dt_s)}",
            serious=True,
        )
    elif len(record) < LEAST_SAMPLES:
        yield Remark(
            record.name,
            f"{len(record)} samples are too few: the noise floor needs {LEAST_SAMPLES}; sample "
            f"faster, or {longer(whole, LEAST_SAMPLES)}",
            serious=True,
        )


def longer(record: Record, samples: float) -> str:
    """Returns what makes the longest part of a record reach a number of samples."""
    if not record.gaps or len(record) < samples * (1.0 - 1e-9):
        return "record for longer"
    return f"{pieces_in_words(record)}: {mend_of_gaps(record)}"


def _rounded_down(value: float) -> float:
    """Returns a value > 0 with two digits, and not larger: 1.9 for 1.98."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / unit + 1e-9) * unit


def check_sampling(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that the sampling resolves the oil spring and separates noise from motion."""
    assert record.dt_s is not None
    spring_hz = oil_spring_hz(rig)
    if spring_hz is not None and spring_hz * record.dt_s > 1.0 / SAMPLES_A_PERIOD:
        yield Remark(
            record.name,
            f"sampled every {1e3 * record.dt_s:.4g} ms, too rarely for the oil spring of some "
            f"{spring_hz:.3g} Hz: oil, lags and delays can hardly be distinguished; sample "
            f"every {_rounded_down(1e3 / (SAMPLES_A_PERIOD * spring_hz)):.2g} ms",
        )
    unresolved = [
        name
        for name, column in record.columns.items()
        if name in CHANNELS and CHANNELS[name].moves and shows_motion(column)
    ]
    if unresolved:
        yield Remark(
            record.name,
            f"the noise of {', '.join(unresolved)} is not white, or cannot be distinguished "
            "from motion at this sampling time: without stretches at rest its floor is only a "
            "bound; record a few seconds at rest, too",
        )
