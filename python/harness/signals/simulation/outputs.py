# SPDX-License-Identifier: MIT
"""Outputs of a simulated plant as columns of a record, optionally with sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

import ehsid

from ...base.arrays import FloatArray
from ...catalogue.channels import CHANNELS
from ...catalogue.keys import ParameterKey
from ...catalogue.parameters import PLANTS
from ...rigs import Rig

# Columns of the output arrays of ehsid.simulate_plant and ehsid.Plant.
OUTPUTS = ehsid.plant_outputs()
OUTPUTS_OF = MappingProxyType(
    {plant: tuple(name for name in OUTPUTS if plant in CHANNELS[name].plants) for plant in PLANTS}
)

QUANTISATION = ParameterKey.of_effect("sensor_quantisation", "step_m")


def columns_of(plant: str, outputs: FloatArray) -> dict[str, FloatArray]:
    """Selects the outputs that the plant has, by name, from an array of shape (N, 6)."""
    return {name: outputs[:, OUTPUTS.index(name)] for name in OUTPUTS_OF[plant]}


def noise_sigma(rig: Rig, output: str) -> float:
    """Standard deviation of the noise of an output in the rig file, in its unit; 0 for none."""
    key = CHANNELS[output].noise
    return 0.0 if key is None else rig.sensors.get(key, 0.0)


def draw_noise(rig: Rig, samples: int, rng: np.random.Generator) -> FloatArray:
    """Draws white Gaussian noise of the rig's sensors, shape (samples, 6), in output units.

    The noise of an output is zero where the rig file gives no standard deviation.
    """
    sigma = np.array([noise_sigma(rig, name) for name in OUTPUTS])
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
    measured = clean + noise
    step = values.get(QUANTISATION, 0.0)
    if step > 0.0:
        position = OUTPUTS.index("position_m")
        measured[..., position] = step * np.round(measured[..., position] / step)
    return measured
