# SPDX-License-Identifier: MIT
"""What a simulated plant shows: columns of a record, with the noise of its sensors where wanted."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.rigs import Rig

# Columns of what ehsid.simulate_plant and ehsid.Plant give.
OUTPUTS = (
    "position_m",
    "velocity_m_s",
    "pressure_a_pa",
    "pressure_b_pa",
    "supply_pressure_pa",
    "spool",
)
OUTPUTS_OF = MappingProxyType(
    {
        "ehs": OUTPUTS,
        "axis": ("position_m", "velocity_m_s"),
        "linear": ("position_m", "velocity_m_s", "spool"),
    }
)

# Standard deviation of the noise by output, as a rig's [sensors] names it.
NOISE_OF = MappingProxyType(
    {
        "position_m": "position_noise_m",
        "velocity_m_s": "velocity_noise_m_s",
        "pressure_a_pa": "pressure_a_noise_pa",
        "pressure_b_pa": "pressure_b_noise_pa",
        "supply_pressure_pa": "supply_pressure_noise_pa",
        "spool": "spool_noise",
    }
)

QUANTISATION = "effects.sensor_quantisation.step_m"


def columns_of(plant: str, outputs: FloatArray) -> dict[str, FloatArray]:
    """Columns that the plant has, from outputs of shape (N, 6)."""
    return {name: outputs[:, OUTPUTS.index(name)] for name in OUTPUTS_OF[plant]}


def draw_noise(rig: Rig, samples: int, rng: np.random.Generator) -> FloatArray:
    """White Gaussian noise of the rig's sensors, shape (samples, 6); zero where none is told."""
    sigma = np.array([rig.sensors.get(NOISE_OF[name], 0.0) for name in OUTPUTS])
    return np.asarray(rng.standard_normal((samples, len(OUTPUTS))) * sigma, dtype=np.float64)


def as_measured(clean: FloatArray, noise: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Outputs with noise, the position in whole steps of its sensor: noise first, as in a machine.

    Parameters
    ----------
    clean
        shape (..., 6), of a plant whose own quantisation is off.
    noise
        the same shape.
    values
        of the rig: its `sensor_quantisation` is applied here.
    """
    shown = clean + noise
    step = values.get(QUANTISATION, 0.0)
    if step > 0.0:
        position = OUTPUTS.index("position_m")
        shown[..., position] = step * np.round(shown[..., position] / step)
    return shown
