# SPDX-License-Identifier: MIT
"""Time lost, on the way to the machine or on the way back from its sensor."""

from __future__ import annotations

import math

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.simulation.injection.effects import InjectError
from ehsid.harness.simulation.injection.notes import (
    Note,
    Step,
    rms,
)

# A delay counts as whole where it is so within a thousandth of a sample: clocks are no better.
WHOLE = 1e-3


def _samples(delay_s: float, dt_s: float, length: int) -> tuple[int, float]:
    """Whole samples and the rest, in samples, of a delay of a signal of this length."""
    samples = delay_s / dt_s
    if samples > 0.5 * length:
        raise InjectError(f"a delay of {delay_s:g} s is more than half of the record")
    whole = round(samples)
    if abs(samples - whole) < WHOLE:
        return whole, 0.0
    return math.floor(samples), samples - math.floor(samples)


def before_delay(command: FloatArray, delay_s: float, dt_s: float) -> Step:
    """What had to be sent: u'(t) = u(t + delay). Shape (N - M,), M samples of delay, rounded up.

    The last M samples of the record are lost: what would have come of them was not recorded. A
    command is held over its sample, so that a rest of f of a sample cannot be had: the machine
    would get f u'_{k-n-1} + (1 - f) u'_{k-n} in place of u_k. Then u' is interpolated, and the
    machine gets u smoothed over three samples.
    """
    whole, rest = _samples(delay_s, dt_s, command.size)
    start = f"the first {delay_s:g} s ran on commands from before the record as it now begins"
    if rest == 0.0:
        return Step(command[whole:].copy(), [Note(start)])
    sent = (1.0 - rest) * command[whole:-1] + rest * command[whole + 1 :]
    received = rest * sent[:-1] + (1.0 - rest) * sent[1:]
    wrong = rms(received - command[whole + 1 : -1]) / max(rms(command), np.finfo(float).tiny)
    return Step(
        sent,
        [
            Note(start),
            Note(
                f"a delay of {delay_s:g} s is not a whole number of samples of {dt_s:g} s: the "
                f"command is interpolated, and what the machine then gets differs from what it got "
                f"by {100.0 * wrong:.2g} % (rms)",
                exact=False,
            ),
        ],
    )


def behind_delay(position: FloatArray, delay_s: float, dt_s: float) -> Step:
    """Shape (N - M,): y'(t) = y(t - delay), from sample M on; between samples a straight line."""
    whole, rest = _samples(delay_s, dt_s, position.size)
    if rest == 0.0:
        return Step(position[: position.size - whole].copy(), [])
    late = rest * position[: -whole - 1] + (1.0 - rest) * position[1 : position.size - whole]
    return Step(
        late,
        [
            Note(
                f"a delay of {delay_s:g} s is not a whole number of samples of {dt_s:g} s: the "
                "position is interpolated, which also averages its noise",
                exact=False,
            )
        ],
    )
