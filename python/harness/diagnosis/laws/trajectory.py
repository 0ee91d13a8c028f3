# SPDX-License-Identifier: MIT
"""What a term of an equation may depend on, along a simulation."""

from __future__ import annotations

import numpy as np

import ehsid

from ...base.arrays import FloatArray
from ..model.problem import Problem

# Rates are the slopes of outputs over this time: one simulated sample has steps.
RATE_S = 0.005
RATES = {
    "acceleration_m_s2": "velocity_m_s",
    "spool_rate_1_s": "spool",
    "pressure_a_rate_pa_s": "pressure_a_pa",
    "pressure_b_rate_pa_s": "pressure_b_pa",
}
LOAD_PRESSURE = "load_pressure_pa"
# The position where the rod extends, and its negative where it retracts: a law that differs by
# direction.
BY_DIRECTION = "position_by_direction_m"


def trajectories(problem: Problem, x: FloatArray) -> list[dict[str, FloatArray]]:
    """Variables of each record by name, shape (N,) each; without those that the plant lacks."""
    values = problem.plant_values(x)[np.newaxis]
    found = []
    for record in problem.records:
        outputs, _ = ehsid.simulate_plant(
            problem.rig.plant,
            values,
            record.record.column("command_v"),
            dt_s=record.dt_s,
            substeps=problem.substeps,
            aligned=record.aligned,
            tables=problem.rig.table_shapes(),
        )
        here = {
            name: np.asarray(column, dtype=np.float64)
            for name, column in zip(ehsid.plant_outputs(), outputs[0].T, strict=True)
            if np.isfinite(column).all()
        }
        for rate, name in RATES.items():
            if name in here:
                here[rate] = _rate(here[name], record.dt_s)
        if {"pressure_a_pa", "pressure_b_pa"} <= here.keys():
            here[LOAD_PRESSURE] = here["pressure_a_pa"] - here["pressure_b_pa"]
        here[BY_DIRECTION] = np.where(here["velocity_m_s"] < 0.0, -1.0, 1.0) * (
            here["position_m"] - float(np.min(here["position_m"]))
        )
        here["time_s"] = record.dt_s * np.arange(len(record.record), dtype=np.float64)
        found.append(here)
    return found


def _rate(signal: FloatArray, dt_s: float) -> FloatArray:
    length = max(1, round(RATE_S / dt_s))
    smooth = np.convolve(signal, np.full(length, 1.0 / length), mode="same")
    return np.asarray(np.gradient(smooth, dt_s), dtype=np.float64)
