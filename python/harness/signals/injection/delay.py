# SPDX-License-Identifier: MIT
"""Delays on the way from the controller to the machine or from the sensor to the log."""

from __future__ import annotations

import math

import numpy as np

from ...base.numbers import FloatArray
from .effects import InjectError, Note, Step, rms

# A delay within a thousandth of a sample of a whole number counts as whole: clocks are no better.
WHOLE = 1e-3


def _samples(delay_s: float, dt_s: float, length: int) -> tuple[int, float]:
    """Splits a delay into whole samples and the rest, in samples.

    `length` is the number of samples of the signal; a delay of more than half of it is refused.
    """
    samples = delay_s / dt_s
    if samples > 0.5 * length:
        raise InjectError(f"a delay of {delay_s:g} s is more than half of the record")
    whole = round(samples)
    if abs(samples - whole) < WHOLE:
        return whole, 0.0
    return math.floor(samples), samples - math.floor(samples)


def before_delay(command: FloatArray, delay_s: float, dt_s: float) -> Step:
    """Returns the command before a delay, u'(t) = u(t + delay), shape (N - M,).

    M is the delay in samples, rounded up. The last M samples of u' are missing, because the command
    after the end of the record is not known. A command is held over its sample, so a delay of n + f
    samples, 0 < f < 1, has no exact pre-image: the machine would get
    f u'_{k-n-1} + (1 - f) u'_{k-n} in place of u_k. Then u' is interpolated, and the machine gets u
    smoothed over three samples.
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
    """Returns the delayed position, y'(t) = y(t - delay), from sample M on; shape (N - M,).

    M is the delay in samples, rounded up. Between samples y is interpolated linearly.
    """
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
