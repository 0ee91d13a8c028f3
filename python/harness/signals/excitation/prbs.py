# SPDX-License-Identifier: MIT
"""Pseudo-random binary sequence.

L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, sec. 13.3.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.signal import max_len_seq


def prbs(n: int, *, amplitude: float, hold: int, bits: int = 10) -> npt.NDArray[np.float64]:
    """Returns a pseudo-random binary sequence of +-amplitude, shape (n,).

    A period is a maximum-length sequence of 2^bits - 1 values, each held for `hold` samples. It is
    repeated or cut to n samples.

    Parameters
    ----------
    n
        number of samples, at least 1.
    amplitude
        amplitude in the unit of the command, finite, >= 0. The mean of a whole period is
        amplitude / (2^bits - 1).
    hold
        number of samples for which a value is held, >= 1. The spectrum is flat up to about
        0.4 / (hold dt_s).
    bits
        length of the shift register, 2 to 20.
    """
    if not (n >= 1 and 0.0 <= amplitude < np.inf and hold >= 1 and 2 <= bits <= 20):
        raise ValueError(
            f"prbs: n = {n}, amplitude = {amplitude:g}, hold = {hold}, bits = {bits}: expected "
            "n >= 1, finite amplitude >= 0, hold >= 1, bits 2 to 20"
        )
    sequence, _ = max_len_seq(bits)
    period = np.repeat(amplitude * (2.0 * sequence - 1.0), hold)
    return np.resize(period, n)
