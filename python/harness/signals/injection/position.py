# SPDX-License-Identifier: MIT
"""Applies effects of a sensor, as the simulator computes them, to a logged position in m."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ehsid import EffectTerms

from ...base.arrays import FloatArray
from ...catalogue.keys import effect_values
from ...catalogue.parameters import plant_parameters
from .notes import Note, Step


def behind_bias(position: FloatArray, offset_m: float) -> Step:
    """Adds the offset to the position."""
    return Step(position + offset_m, [])


def behind_sensor(
    position: FloatArray, effect: str, sizes: Mapping[str, float], dt_s: float
) -> Step:
    """Applies an effect of the catalogue on the sensor, which rested before the first sample.

    Parameters
    ----------
    position
        logged position, m, shape (N,); it is taken to be linear between the samples.
    effect, sizes
        id of the effect, and its parameters by their own names.
    dt_s
        sampling time, s.
    """
    values = effect_values(effect, sizes)
    terms = EffectTerms(np.array([values.get(name, 0.0) for name in plant_parameters()]))
    lag_s, _ = terms.sensor_error
    notes = [Note("noise that was in the position has gone through the lag, too")] if lag_s else []
    return Step(terms.sensor(position, dt_s), notes)
