# SPDX-License-Identifier: MIT
"""Noise floor of a channel, also where the sampling is too slow to tell noise from motion."""

from __future__ import annotations

import numpy as np

from ...catalogue.channels import CHAMBER_PRESSURES, CHANNELS
from ...records import Record
from ...rigs import Rig
from .cylinder import oil_spring_hz
from .floor import REST_WINDOWS, NoiseFloor, floor_of
from .repeats import repeat_errors
from .rest import rest_errors

# With fewer than four samples in a period of the oil spring, neighbouring samples differ by motion
# as much as by noise, and differences of any order show both.
SPRING_HIDES_NOISE = 0.25
# Noise of usual sensors, where motion hides it and the rig file does not tell it: of a position
# sensor, share of the stroke; of others, share of the range in the record. For pressures see
# DESIGN_PRESSURE_NOISE.
NOISE_OF_STROKE = 5e-5
NOISE_OF_RANGE = 1e-3
# Assumed noise of a pressure sensor that is not installed yet, share of the supply pressure. A
# thousandth of its range is usual.
DESIGN_PRESSURE_NOISE = 1e-3


def sensor_floor(record: Record, name: str, rig: Rig) -> NoiseFloor:
    """Noise floor as `floor_of` estimates it, or of a usual sensor where motion hides the noise.

    A load on its oil spring still moves at frequencies near the sampling rate of a slow record, so
    that differences of neighbouring samples show this motion. They are then an upper bound that is
    far too high: it would hide every effect. Unless repeats or rests show the noise, the floor is
    then what the rig file tells of the sensor, or else the noise of a usual sensor, but never more
    than the bound.

    Parameters
    ----------
    record
        without gaps, of at least 100 samples.
    name
        name of the column.
    rig
        configuration of the simulator, with the noise of the sensors, if known.
    """
    floor = floor_of(record, name)
    spring_hz = oil_spring_hz(rig)
    assert record.dt_s is not None
    if spring_hz is None or spring_hz * record.dt_s < SPRING_HIDES_NOISE:
        return floor
    if any(len(errors(record, name)) >= REST_WINDOWS for errors in (repeat_errors, rest_errors)):
        return floor
    value = min(_expected(record, name, rig), floor.value)
    return NoiseFloor(value, min(value, floor.low), max(value, floor.high))


def _expected(record: Record, name: str, rig: Rig) -> float:
    """Noise that the rig file tells, or that of a usual sensor, in the unit of the channel."""
    key = CHANNELS[name].noise
    if key is not None and rig.sensors.get(key, 0.0) > 0.0:
        return rig.sensors[key]
    if name == "position_m" and "cylinder.stroke_m" in rig.values:
        return NOISE_OF_STROKE * rig.values["cylinder.stroke_m"]
    if name in (*CHAMBER_PRESSURES, "supply_pressure_pa") and "supply.pressure_pa" in rig.values:
        return DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
    return NOISE_OF_RANGE * float(np.ptp(record.column(name)))
