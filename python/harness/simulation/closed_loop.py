# SPDX-License-Identifier: MIT
"""A rig under position control: the reference becomes a command, sample by sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation.controller import PositionController
from ehsid.harness.simulation.outputs import OUTPUTS, QUANTISATION
from ehsid.harness.simulation.run import (
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
    """What came out.

    Attributes
    ----------
    run
        record, steps and error of the integration.
    reference_m
        shape (N,).
    limited
        shape (N,), where the command was at the controller's limit.
    """

    run: SimulationRun
    reference_m: FloatArray
    limited: npt.NDArray[np.bool_]


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
    """Let a controller follow a reference, from rest at its first value.

    The controller reads the position at t_k as the sensor shows it, with noise and in steps, and
    its command acts from t_k on.

    Parameters
    ----------
    rig
        the machine.
    reference_m
        shape (N,), finite, within the stroke.
    controller
        e.g. `suggested_controller(rig)`.
    dt_s
        sampling time in seconds.
    values
        in place of those of the rig, by full name.
    noise
        shape (N, 6), see `draw_noise`.
    name
        of the record.
    progress
        is called with the share that is done, 0 to 1.

    Raises
    ------
    SimulationError
        a reference that is not finite or outside the stroke, a loop that is not stable, or as
        `simulate`.
    """
    reference = checked_samples("reference", reference_m)
    stroke = {**rig.values, **(values or {})}.get("cylinder.stroke_m")
    if stroke is not None and not (reference.min() >= 0.0 and reference.max() <= stroke):
        raise SimulationError(
            f"the reference runs from {reference.min():.4g} to {reference.max():.4g} m, beyond the "
            f"stroke of 0 to {stroke:g} m: take a smaller one, or another start"
        )
    start = prepare(rig, dt_s=dt_s, position0_m=float(reference[0]), values=values)
    step = start.told.get(QUANTISATION, 0.0)
    position_noise = np.zeros(reference.size) if noise is None else noise[:, POSITION]
    speed = np.append(np.diff(reference), 0.0) / dt_s
    report = progress or (lambda _share: None)
    every = max(1, reference.size // REPORTS)

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
        if k % every == 0:
            report(0.5 * k / reference.size)

    # The same plant from the same start on that command: the same run, with its error.
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
