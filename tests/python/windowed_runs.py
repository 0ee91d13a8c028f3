# SPDX-License-Identifier: MIT
"""Simulates a rig on the command of a record in windows, apart from how a diagnosis does it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.simulation.run import OUTPUTS_OF, prepare
from ehsid.harness.signals.simulation.windows import measured_states, window_numbers


@dataclass(frozen=True, eq=False)
class WindowedRun:
    """Outputs (M, N) of M sets of values and N samples, their sensitivities (M, N, S) to S values,
    and the window of each sample."""

    outputs: Mapping[str, FloatArray]
    sensitivities: Mapping[str, FloatArray]
    window: npt.NDArray[np.int64]


def simulate_windows(
    rig: Rig,
    record: Record,
    *,
    window_s: float = 0.5,
    skip_s: float = 0.3,
    reset: str = "carry",
    value_sets: Sequence[Mapping[str, float]] = ({},),
    varied: Sequence[str] = (),
    substeps: int | None = None,
) -> WindowedRun:
    """At the begin of a window "carry" sets the position to its measured value, "estimate" all
    states that `measured_states` gives. The first sample has them all."""
    assert record.dt_s is not None
    dt_s, names = record.dt_s, [parameter.name for parameter in ehsid.plant_parameters()]
    states = measured_states(record)
    window = window_numbers(len(record), dt_s, window_s=window_s, skip_s=skip_s)
    begins = np.flatnonzero(np.diff(window, prepend=-2) > 0)
    aligned = np.full_like(states, np.nan)
    aligned[0] = states[0]
    which = slice(0, 1) if reset == "carry" else slice(None)
    aligned[begins, which] = states[begins, which]
    sets = [prepare(rig, dt_s=dt_s, values=one, substeps=2).plant_values for one in value_sets]
    found = ehsid.simulate_plant(
        rig.plant,
        np.hstack([np.array(sets), np.tile(rig.table_values(), (len(sets), 1))]),
        record.column("command_v"),
        dt_s=dt_s,
        substeps=substeps or max(ehsid.plant_substeps(rig.plant, one, dt_s) for one in sets),
        varied=[names.index(name) for name in varied],
        aligned=aligned,
        tables=rig.table_shapes(),
    )
    columns = {name: OUTPUTS_OF["ehs"].index(name) for name in OUTPUTS_OF[rig.plant]}
    outputs, sensitivities = ({name: of[..., i] for name, i in columns.items()} for of in found)
    return WindowedRun(outputs, sensitivities, window)
