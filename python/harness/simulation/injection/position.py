# SPDX-License-Identifier: MIT
"""Applies effects of a sensor, as the catalogue defines them, to a logged position in m."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from ehsid._core import play
from ehsid.harness.arrays import FloatArray
from ehsid.harness.simulation.injection.notes import Note, Step


def behind_bias(position: FloatArray, offset_m: float) -> Step:
    """Adds the offset to the position."""
    return Step(position + offset_m, [])


def behind_play(position: FloatArray, half_width_m: float) -> Step:
    """Applies play with half width h: m_k = min(max(m_{k-1}, y_k - h), y_k + h), m_0 = y_0."""
    return Step(play(position, half_width_m, start=position[0]), [])


def behind_lag(position: FloatArray, time_constant_s: float, dt_s: float) -> Step:
    """Applies the lag tau m' = y - m; exact where y is linear between samples.

    With the slope s and d = exp(-dt / tau): m_k = d (m_{k-1} - y_{k-1} + tau s) + y_k - tau s.
    """
    decay = math.exp(-dt_s / time_constant_s)
    ahead = time_constant_s / dt_s * (1.0 - decay)
    away, _ = lfilter([1.0 - ahead, ahead - decay], [1.0, -decay], position - position[0], zi=[0.0])
    return Step(
        position[0] + away,
        [Note("noise that was in the position has gone through the lag, too")],
    )


def behind_quantisation(position: FloatArray, step_m: float) -> Step:
    """Rounds the position to whole steps: step round(y / step), halves away from zero."""
    steps = position / step_m
    return Step(step_m * np.sign(steps) * np.floor(np.abs(steps) + 0.5), [])
