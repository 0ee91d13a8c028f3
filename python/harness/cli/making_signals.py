# SPDX-License-Identifier: MIT
"""Makes test signals by name, scaled by the highest frequency of interest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ehsid.harness.cli.signals import SignalName
from ehsid.harness.excitation import chirp, odd_multisine, prbs, random_steps, triangle


def make_signal(
    name: SignalName, n: int, dt_s: float, *, peak: float, top_hz: float, seed: int
) -> npt.NDArray[np.float64]:
    """Returns a signal with this peak that excites up to about `top_hz`, shape (n,)."""
    rng = np.random.default_rng(seed)
    duration = n * dt_s
    low = max(top_hz / 200.0, 2.0 / duration)
    match name:
        case SignalName.multisine:
            return odd_multisine(n, dt_s, band_hz=(low, top_hz), peak=peak, rng=rng).samples
        case SignalName.prbs:
            return prbs(n, amplitude=peak, hold=max(1, round(0.4 / (top_hz * dt_s))))
        case SignalName.steps:
            hold = (max(1, round(1.0 / (top_hz * dt_s))), max(1, round(10.0 / (top_hz * dt_s))))
            return random_steps(n, amplitude=peak, hold=hold, rng=rng)
        case SignalName.chirp:
            return chirp(n, dt_s, amplitude=peak, band_hz=(low, top_hz))
        case SignalName.triangle:
            return triangle(n, dt_s, amplitude=peak, period_s=duration / 4.0)
