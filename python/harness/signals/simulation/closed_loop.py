# SPDX-License-Identifier: MIT
"""Simulates a rig under position control: the controller computes each command sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...rigs import Rig
from .controller import PositionController
from .run import (
    OUTPUTS,
    QUANTISATION,
    Progress,
    SimulationError,
    SimulationRun,
    checked_samples,
    prepare,
    simulate,
)

POSITION = OUTPUTS.index("position_m")
REPORTS = 100


@dataclass(frozen=True, eq=False)
class ClosedLoopRun:
    """Result of a closed-loop simulation of N samples."""

    run: SimulationRun
    """Record, with the number of integration steps and the integration error."""
    reference_m: FloatArray
    """Reference position, m, shape (N,)."""
    limited: npt.NDArray[np.bool_]
    """Shape (N,), true where the command was at the controller's limit."""


def simulate_closed_loop(
    rig: Rig,
    reference_m: npt.ArrayLike,
    controller: PositionController,
    *,
    dt_s: float,
    values: Mapping[str, float] | None = None,
    noise: FloatArray | None = None,
    name: str | None = None,
    progress: Progress | None = None,
) -> ClosedLoopRun:
    """Simulates a rig whose controller follows a reference, from rest at its first value.

    At t_k the controller reads the position as the sensor shows it, with noise and quantised. Its
    command acts from t_k on.

    Parameters
    ----------
    rig
        rig to simulate.
    reference_m
        reference position, m, shape (N,), finite, within the stroke.
    controller
        position controller, e.g. `suggested_controller(rig)`.
    dt_s
        sampling time in seconds.
    values
        values that replace those of the rig, by full name.
    noise
        noise that is added to the outputs, shape (N, 6), see `draw_noise`.
    name
        name of the record.
    progress
        called with the share of the work that is done, 0 to 1.

    Raises
    ------
    SimulationError
        the reference is not finite or is outside the stroke, the loop is not stable, or an error
        of `simulate`.
    """
    reference = checked_samples("reference", reference_m)
    stroke = {**rig.values, **(values or {})}.get("cylinder.stroke_m")
    if stroke is not None and not (reference.min() >= 0.0 and reference.max() <= stroke):
        raise SimulationError(
            f"the reference runs from {reference.min():.4g} to {reference.max():.4g} m, beyond the "
            f"stroke of 0 to {stroke:g} m: take a smaller one, or another start"
        )
    start = prepare(rig, dt_s=dt_s, position0_m=float(reference[0]), values=values)
    step = start.values.get(QUANTISATION, 0.0)
    position_noise = np.zeros(reference.size) if noise is None else noise[:, POSITION]
    speed = np.append(np.diff(reference), 0.0) / dt_s
    report = progress or (lambda _share: None)
    report_interval = max(1, reference.size // REPORTS)

    plant = start.plant(quantised=False)
    command = np.empty(reference.size)
    integral = 0.0
    for k in range(reference.size):
        position = float(plant.read()[POSITION]) + position_noise[k]
        if not np.isfinite(position):
            raise SimulationError(
                f"{rig.name}: the loop is not finite from sample {k + 1} on: take a lower gain"
            )
        if step > 0.0:
            position = step * round(position / step)
        command[k], integral = controller.step(
            integral, float(reference[k]), position, float(speed[k]), dt_s
        )
        plant.advance(command[k])
        if k % report_interval == 0:
            report(0.5 * k / reference.size)

    # The same plant with the same start and command gives the same run, here with its error.
    run = simulate(
        rig,
        command,
        dt_s=dt_s,
        position0_m=float(reference[0]),
        values=values,
        substeps=start.substeps,
        noise=noise,
        name=name,
        progress=lambda share: report(0.5 + 0.5 * share),
    )
    return ClosedLoopRun(run, reference, np.abs(command) >= controller.limit_v)
