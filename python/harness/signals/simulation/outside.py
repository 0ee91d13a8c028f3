# SPDX-License-Identifier: MIT
"""One run of a user's simulator on a command, with the effects of the rig file around it.

Such a run has no second one with half the step: nobody but its maker knows how it integrates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.spellings import ParameterKey
from ...records import make_record
from ...rigs import Rig, RigError
from ...simulators.around import Told
from ...simulators.runs import SimulatorRuns, opened_runs
from .run import (
    OUTPUTS,
    QUANTISATION,
    SimulationError,
    SimulationRun,
    as_measured,
    check_inside,
    checked_samples,
)

POSITION = "position_m"
START = ParameterKey.of_initial(POSITION)


@contextmanager
def opened_outside(rig: Rig, position0_m: float | None = None) -> Iterator[SimulatorRuns | None]:
    """Opens the user's simulator of a rig; gives None for a rig with another plant.

    Raises
    ------
    SimulatorError
        the program cannot be opened, or is no simulator of a servo.
    ValueError
        a start is given that the rig file has no place for.
    """
    if rig.simulator is None:
        yield None
        return
    told = POSITION in rig.simulator.start
    if position0_m is not None and not told:
        raise ValueError(
            f"a start at {position0_m:g} m: the simulator of {rig.name} starts where it does; name "
            "the value that states its start in [simulator.start] of the rig file"
        )
    if told and position0_m is None and "cylinder.stroke_m" not in rig.values:
        # Nobody tells where mid-stroke is, but the simulator has a start of its own.
        rig = replace(rig, simulator=replace(rig.simulator, start={}))
    with opened_runs(rig) as runs:
        yield runs


def simulate_outside(
    runs: SimulatorRuns,
    command_v: FloatArray,
    *,
    dt_s: float,
    position0_m: float | None = None,
    values: Mapping[str, float] | None = None,
    keep_inside: bool = False,
    noise: FloatArray | None = None,
    name: str | None = None,
) -> SimulationRun:
    """Runs the opened simulator on a command; the arguments are those of `simulate`.

    The record has the outputs that the simulator gives. The run has no error of integration.

    Raises
    ------
    SimulationError
        the command is not finite, a value cannot be taken, or the run ends early or leaves the
        stroke.
    """
    command = checked_samples("command", command_v)
    try:
        rig = runs.rig.with_values(values or {})
    except RigError as error:
        raise SimulationError("; ".join(error.problems)) from error
    # The sensor's noise is added before its steps.
    overrides: dict[str, float] = {QUANTISATION: 0.0}
    if position0_m is not None:
        overrides[START] = position0_m
    plant_values = rig.plant_values(overrides)
    all_values = np.hstack([plant_values, runs.own_values(rig)])
    told = Told(command, np.zeros(command.size), np.zeros(command.size, np.uint8), dt_s)
    outputs = runs.outputs(told, all_values)
    given = [name for name in OUTPUTS if name in runs.section.outputs]
    columns = [OUTPUTS.index(name) for name in given]
    bad = np.flatnonzero(~np.isfinite(outputs[:, columns]).all(axis=1))
    if bad.size:
        why = "; ".join(runs.failures) or f"the run is not finite from sample {bad[0] + 1} on"
        raise SimulationError(f"{runs.section.what}: {why}")
    stroke = rig.values.get("cylinder.stroke_m")
    if keep_inside and stroke is not None:
        check_inside(outputs[:, OUTPUTS.index(POSITION)], stroke, dt_s)
    measured = as_measured(outputs, np.zeros(()) if noise is None else noise, rig.values)
    record = make_record(
        {
            "time_s": np.arange(command.size) * dt_s,
            "command_v": command,
            **{name: measured[:, column] for name, column in zip(given, columns, strict=True)},
        },
        name=name or rig.name,
    )
    return SimulationRun(record, runs.steps(plant_values, dt_s), MappingProxyType({}))
