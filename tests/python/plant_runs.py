# SPDX-License-Identifier: MIT
"""What the tests of the plant share: commands, values by name, errors against the reference."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from plant_reference import OUTPUTS, Reference, typical

import ehsid

FloatArray = npt.NDArray[np.float64]
NAMES = [parameter.name for parameter in ehsid.plant_parameters()]
DT_S = 2e-3


def steps(seed: int, samples: int, held: int, size: float) -> FloatArray:
    """Random levels, each held for some samples."""
    levels = np.random.default_rng(seed).uniform(-size, size, -(-samples // held))
    return np.repeat(levels, held)[:samples]


def vector(values: Mapping[str, float]) -> FloatArray:
    return np.array([[values[name] for name in NAMES]])


def linear_servo(values: Mapping[str, float]) -> ehsid.ContinuousServo:
    """Eqs. (1)-(5), of the linear plant."""
    p = {name.removeprefix("linear."): value for name, value in values.items()}
    return ehsid.continuous_servo(
        ehsid.ServoParameters(
            k_v=p["spool_gain_1_v"],
            k_q=p["flow_gain_m3_s"],
            k_c=p["flow_pressure_m3_s_pa"],
            c_p=p["leakage_m3_s_pa"],
            a_p=p["area_m2"],
            v_t=p["volume_m3"],
            beta_e=p["bulk_modulus_pa"],
            m_t=p["mass_kg"],
        )
    )


def simulate(
    values: Mapping[str, float], command: FloatArray, substeps: int, plant: str = "ehs"
) -> dict[str, FloatArray]:
    outputs, _ = ehsid.simulate_plant(plant, vector(values), command, dt_s=DT_S, substeps=substeps)
    return {name: outputs[0, :, i] for i, name in enumerate(OUTPUTS)}


# What a machine has on which an effect shows that does not act on the typical one.
SHOWN_ON: Mapping[str, Mapping[str, float]] = {
    # A heavy load that is braked draws a chamber below the tank pressure.
    "makeup_check": {"load.mass_kg": 800.0},
}


def shows(effect: str) -> dict[str, float]:
    """The typical rig, or one on which the effect shows."""
    return typical() | SHOWN_ON.get(effect, {})


def with_effect(effect: ehsid.EffectInfo) -> dict[str, float]:
    """The same with the effect at its typical size."""
    return shows(effect.id) | {
        f"effects.{effect.id}.{parameter.name}": parameter.typical
        for parameter in effect.parameters
    }


def worst_error(
    found: Mapping[str, FloatArray], expected: Mapping[str, FloatArray], names: tuple[str, ...]
) -> float:
    """Largest difference of any of the outputs, as a share of the output's range."""
    return max(
        float(np.max(np.abs(found[name] - expected[name])) / np.ptp(expected[name]))
        for name in names
    )


def reference(
    values: Mapping[str, float], command: FloatArray, plant: str = "ehs", method: str = "LSODA"
) -> dict[str, FloatArray]:
    return Reference(plant, values).run(command, DT_S, method=method)
