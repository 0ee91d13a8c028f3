# SPDX-License-Identifier: MIT
"""Readings of the chamber pressures by transducers that are not right.

A transducer whose span is wrong is a little bowed, too, and one that lags has a filter of second
order: neither is exactly the law of the catalogue.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from ehsid.harness.base.numbers import FloatArray

from .truth import Truth

# Bow of a wrong span: its largest deviation from the line is this share of the error of the span.
BOW = 0.05
# Share of the time constant that the second stage of a filter has.
SECOND = 0.15


def pressure_reading(true_pa: FloatArray, side: str, machine: Truth, dt_s: float) -> FloatArray:
    """Returns what the transducer of a chamber shows without noise, Pa, shape (n,).

    side: "a" or "b".
    """
    gain = float(getattr(machine, f"pressure_gain_{side}"))
    share = true_pa / machine.source_pa
    bow = 4.0 * BOW * (gain - 1.0) * machine.source_pa * share * (1.0 - share)
    shown = gain * true_pa + bow + float(getattr(machine, f"pressure_offset_{side}_pa"))
    if machine.pressure_lag_s > 0.0:
        for part in (1.0 - SECOND, SECOND):
            # m' = (p - m) / tau, by the trapezoidal rule
            turn = 2.0 * part * machine.pressure_lag_s / dt_s
            rest = lfilter([1.0, 1.0], [1.0 + turn, 1.0 - turn], shown - shown[0])
            shown = shown[0] + np.asarray(rest, dtype=np.float64)
    return shown
