# SPDX-License-Identifier: MIT
"""Outputs of a simulated plant as columns of a record, optionally with sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.rigs import Rig

# Columns of the output arrays of ehsid.simulate_plant and ehsid.Plant.
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

# For each output, the key in [sensors] of a rig file with the standard deviation of its noise.
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
    """Selects the outputs that the plant has, by name, from an array of shape (N, 6)."""
    return {name: outputs[:, OUTPUTS.index(name)] for name in OUTPUTS_OF[plant]}


def draw_noise(rig: Rig, samples: int, rng: np.random.Generator) -> FloatArray:
    """Draws white Gaussian noise of the rig's sensors, shape (samples, 6), in output units.

    The noise of an output is zero where the rig file gives no standard deviation.
    """
    sigma = np.array([rig.sensors.get(NOISE_OF[name], 0.0) for name in OUTPUTS])
    return np.asarray(rng.standard_normal((samples, len(OUTPUTS))) * sigma, dtype=np.float64)


def as_measured(clean: FloatArray, noise: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Adds noise to the outputs, then quantises the position, in the order of a real sensor.

    Parameters
    ----------
    clean
        outputs, shape (..., 6), of a plant whose own quantisation is off.
    noise
        noise in output units, of the same shape.
    values
        values of the rig by full name; the step of its `sensor_quantisation` is applied here.
    """
    shown = clean + noise
    step = values.get(QUANTISATION, 0.0)
    if step > 0.0:
        position = OUTPUTS.index("position_m")
        shown[..., position] = step * np.round(shown[..., position] / step)
    return shown
