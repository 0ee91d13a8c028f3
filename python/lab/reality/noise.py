# SPDX-License-Identifier: MIT
"""Errors of sensors and clocks: coloured noise, steps of converters, samples taken late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from ehsid.harness.base.numbers import FloatArray

from .nominal_rig import NominalRig, spread

POSITION_STEPS_M = (1e-7, 2e-7, 5e-7, 1e-6, 2e-6)
PRESSURE_STEPS_PA = (1000.0, 2000.0, 2500.0, 5000.0)


@dataclass(frozen=True)
class Logger:
    """How a rig is measured."""

    coloured_share: float
    pole: float
    """Share of the noise's variance that comes from a first-order filter, and its pole."""
    largest_late_s: float
    """Samples are taken late by up to this time, s."""
    position_step_m: float
    pressure_step_pa: float
    command_step: float = 2.0**-15
    """Steps of the converters; the last one as a fraction of the rated command."""


def usual_logger(rig: NominalRig, dt_s: float, hard: bool) -> Logger:
    """Returns the logger of a rig; that of a hard one has a coloured noise and a worse clock."""
    supply = rig.values.get("supply.pressure_pa", 1e7)
    return Logger(
        0.5 if hard else 0.15,
        0.9 if hard else 0.6,
        # The clock of a slow logger is no worse than that of a fast one.
        (0.02 if hard else 0.002) * min(dt_s, 1e-3),
        min(POSITION_STEPS_M, key=lambda step: abs(step - 3e-6 * rig.stroke_m)),
        min(PRESSURE_STEPS_PA, key=lambda step: abs(step - 2e-4 * supply)),
    )


def draw_logger(rng: np.random.Generator, rig: NominalRig, dt_s: float) -> Logger:
    """Draws a logger: converters of 12 to 16 bits, and a clock that is late by up to 2 %.

    The position has 16 to 18 bits: a coarser one would be an effect. Seven of ten clocks are late
    by up to 0.1 to 0.5 % of the sampling time, the others by up to 1 to 2 %.
    """
    share, pole = float(rng.uniform(0.1, 0.55)), float(rng.uniform(0.6, 0.9))
    late = spread(rng, 0.001, 0.005) if rng.random() < 0.7 else spread(rng, 0.01, 0.02)
    bits = [int(rng.choice(choice)) for choice in ((16, 17, 18), (12, 14, 16), (12, 14, 16))]
    # A pressure transducer's range is 1.25 times the supply pressure; a DAC covers both signs.
    return Logger(
        share,
        pole,
        late * dt_s,
        rig.stroke_m * 2.0 ** -bits[0],
        1.25 * rig.values["supply.pressure_pa"] * 2.0 ** -bits[1],
        2.0 ** (1 - bits[2]),
    )


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


def draw_noise(rng: np.random.Generator, rig: NominalRig, samples: int, logger: Logger) -> Noise:
    """Draws the noise of one record; its size is proportional to that of the machine.

    The standard deviation is 2e-5 of the stroke for the position and 1e-3 of the supply pressure
    for pressures, each times a factor of 0.6 to 1.6.
    """
    share, pole = logger.coloured_share, logger.pole
    position = 2e-5 * rig.stroke_m * spread(rng, 0.6, 1.6)
    supply = rig.values.get("supply.pressure_pa", 1e7)
    pressure = 1e-3 * supply * spread(rng, 0.6, 1.6)
    return Noise(
        position_m=position * coloured(rng, samples, share, pole),
        pressures_pa={
            name: pressure * coloured(rng, samples, share, pole)
            for name in ("pressure_a_pa", "pressure_b_pa", "supply_pressure_pa")
        },
        spool=2e-3 * coloured(rng, samples, share, pole),
        late_s=logger.largest_late_s * rng.random(samples),
        position_step_m=logger.position_step_m,
        pressure_step_pa=logger.pressure_step_pa,
        command_step=logger.command_step,
    )
