# SPDX-License-Identifier: MIT
"""Errors of sensors and clocks: coloured noise, steps of converters, samples taken late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from ehsid.harness.arrays import FloatArray
from ehsid.harness.validation.reality.nominal_rig import NominalRig, spread

POSITION_STEPS_M = (1e-7, 2e-7, 5e-7, 1e-6, 2e-6)
PRESSURE_STEPS_PA = (1000.0, 2000.0, 2500.0, 5000.0)


@dataclass(frozen=True)
class Noise:
    """Noise of one record, each signal (n,), and steps of the converters.

    Spool and command are fractions of their full values.
    """

    position_m: FloatArray
    pressures_pa: Mapping[str, FloatArray]
    spool: FloatArray
    late_s: FloatArray
    position_step_m: float
    pressure_step_pa: float
    command_step: float


def coloured(rng: np.random.Generator, samples: int, share: float, pole: float) -> FloatArray:
    """Noise of variance 1, (samples,): white, but with a share from a first-order filter."""
    white = rng.standard_normal(samples)
    slow = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal(samples))
    return np.asarray(np.sqrt(1.0 - share) * white + np.sqrt(share) * slow)


def draw_noise(
    rng: np.random.Generator, rig: NominalRig, samples: int, dt_s: float, hard: bool
) -> Noise:
    """Draws the noise of one record; its size is proportional to that of the machine.

    The standard deviation is 2e-5 of the stroke for the position and 1e-3 of the supply pressure
    for pressures, each times a factor of 0.6 to 1.6.
    """
    share, pole = (0.5, 0.9) if hard else (0.15, 0.6)
    position = 2e-5 * rig.stroke_m * spread(rng, 0.6, 1.6)
    supply = rig.values.get("supply.pressure_pa", 1e7)
    pressure = 1e-3 * supply * spread(rng, 0.6, 1.6)
    # The clock of a slow logger is no worse than that of a fast one.
    largest_delay = (0.02 if hard else 0.002) * min(dt_s, 1e-3)
    return Noise(
        position_m=position * coloured(rng, samples, share, pole),
        pressures_pa={
            name: pressure * coloured(rng, samples, share, pole)
            for name in ("pressure_a_pa", "pressure_b_pa", "supply_pressure_pa")
        },
        spool=2e-3 * coloured(rng, samples, share, pole),
        late_s=largest_delay * rng.random(samples),
        position_step_m=min(POSITION_STEPS_M, key=lambda step: abs(step - 3e-6 * rig.stroke_m)),
        pressure_step_pa=min(PRESSURE_STEPS_PA, key=lambda step: abs(step - 2e-4 * supply)),
        command_step=2.0**-15,
    )
