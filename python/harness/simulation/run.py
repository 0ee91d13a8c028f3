# SPDX-License-Identifier: MIT
"""One run of the simulator, with the error of its integration, as a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.checks import check_together, check_values
from ehsid.harness.rigs.parameters import INITIAL_PREFIX

FloatArray = npt.NDArray[np.float64]

OUTPUTS = (
    "position_m",
    "velocity_m_s",
    "pressure_a_pa",
    "pressure_b_pa",
    "supply_pressure_pa",
    "spool",
)
AXIS_OUTPUTS = ("position_m", "velocity_m_s")

# Steps a sample beyond which a rig is taken for one that cannot be integrated: at 1 kHz they
# resolve oscillations of 10 kHz, where a lumped model says nothing any more.
MOST_SUBSTEPS = 1000

# A single run can afford more steps than a fit of thousands: a sixteenth of the error.
FINER = 4


class SimulationError(ValueError):
    """A rig, command or start that cannot be simulated; the message says which and why."""


@dataclass(frozen=True, eq=False)
class SimulationRun:
    """What came out of a run.

    Attributes
    ----------
    record
        time, command and all outputs of the plant.
    substeps
        steps of integration a sample.
    error
        for each output the largest difference to a run with half the step, as a share of the
        output's range: by the order of the method, four thirds of it is the error of this run.
    """

    record: Record
    substeps: int
    error: Mapping[str, float]


def simulate(
    rig: Rig,
    command_v: npt.ArrayLike,
    *,
    dt_s: float,
    position0_m: float | None = None,
    values: Mapping[str, float] | None = None,
    substeps: int | None = None,
    keep_inside: bool = False,
    name: str | None = None,
) -> SimulationRun:
    """Run a rig on a command, from rest in equilibrium.

    Parameters
    ----------
    rig
        the machine.
    command_v
        shape (N,), finite; each sample is held until the next.
    dt_s
        sampling time in seconds.
    position0_m
        start, within the stroke; mid-stroke by default.
    values
        in place of those of the rig, by full name.
    substeps
        steps of integration a sample; by default four times what the rig's fastest oscillation
        asks for at least.
    keep_inside
        refuse a run that reaches an end of the stroke.
    name
        of the record.

    Raises
    ------
    SimulationError
        a command that is not finite, a start outside the stroke, a rig too stiff to be integrated,
        a run that is not finite or leaves the stroke.
    """
    command = np.asarray(command_v, dtype=np.float64)
    if command.ndim != 1 or command.size < 2:
        raise SimulationError(f"the command has shape {command.shape}: expected at least 2 samples")
    bad = np.flatnonzero(~np.isfinite(command))
    if bad.size:
        raise SimulationError(
            f"the command is not finite at sample {bad[0] + 1}: {command[bad[0]]}"
        )
    told = dict(values or {})
    if position0_m is not None:
        told[f"{INITIAL_PREFIX}position_m"] = position0_m
    problems = check_values(told) + check_together({**rig.values, **told})
    if problems:
        raise SimulationError("; ".join(problems))
    stroke = {**rig.values, **told}.get("cylinder.stroke_m")
    plant_values = rig.plant_values(told)
    _check_start(plant_values, stroke)
    if substeps is None:
        substeps = FINER * ehsid.plant_substeps(rig.plant, plant_values, dt_s)
        if substeps > MOST_SUBSTEPS // 2:
            raise SimulationError(
                f"{rig.name} is too stiff to be integrated at {dt_s:g} s: its oil spring or its "
                f"seals need {substeps} steps a sample; check masses, volumes, friction"
            )

    def outputs(steps: int) -> FloatArray:
        found, _ = ehsid.simulate_plant(
            rig.plant, plant_values[np.newaxis], command, dt_s=dt_s, substeps=steps
        )
        return np.asarray(found[0], dtype=np.float64)

    coarse, fine = outputs(substeps), outputs(min(2 * substeps, MOST_SUBSTEPS))
    if not np.isfinite(coarse).all():
        first = int(np.flatnonzero(~np.isfinite(coarse).all(axis=1))[0])
        raise SimulationError(f"{rig.name}: the run is not finite from sample {first + 1} on")
    if keep_inside and stroke is not None:
        _check_inside(coarse[:, 0], stroke, dt_s)
    names = OUTPUTS if rig.plant == "ehs" else AXIS_OUTPUTS
    columns = {name: coarse[:, i] for i, name in enumerate(names)}
    error = {
        output: float(np.max(np.abs(fine[:, i] - coarse[:, i])) / max(np.ptp(coarse[:, i]), 1e-12))
        for i, output in enumerate(names)
    }
    record = make_record(
        {"time_s": np.arange(command.size) * dt_s, "command_v": command, **columns},
        name=name or rig.name,
    )
    return SimulationRun(record, substeps, MappingProxyType(error))


def _check_start(plant_values: FloatArray, stroke: float | None) -> None:
    names = [parameter.name for parameter in ehsid.plant_parameters()]
    start = plant_values[names.index(f"{INITIAL_PREFIX}position_m")]
    if stroke is not None and not 0.0 <= start <= stroke:
        raise SimulationError(f"the start at {start:g} m is outside the stroke, 0 to {stroke:g} m")


def _check_inside(position: FloatArray, stroke: float, dt_s: float) -> None:
    outside = np.flatnonzero((position < 0.0) | (position > stroke))
    if outside.size:
        raise SimulationError(
            f"the rod reaches an end of its stroke (0 to {stroke:g} m) after "
            f"{outside[0] * dt_s:.3g} s: take a smaller or shorter excitation, or another start"
        )
