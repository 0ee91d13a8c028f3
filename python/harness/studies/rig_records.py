# SPDX-License-Identifier: MIT
"""Records of a simulated rig for the experiment: 100 s at 50 ms, the rod kept inside its stroke."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.excitation import multisine
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import draw_noise, simulate
from ehsid.harness.simulation.outputs import as_measured, columns_of
from ehsid.harness.simulation.run import prepare
from ehsid.harness.simulation.windows import STATES
from ehsid.harness.studies.published import DT_S, DURATION_S

SAMPLES = round(DURATION_S / DT_S)
BAND_HZ = (0.05, 5.0)
# Share of rated command: small enough that the orifices look linear, large against null.
RMS_OF_RATED = 0.1
LEAD = 5


@dataclass(frozen=True, eq=False)
class RigRecord:
    """A record and the constant that had to be added to the command to stay inside the stroke."""

    record: Record
    trim_v: float


def excitation_of(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """Random-phase multisine of a tenth of rated command (rms), shape (2000,), mean zero."""
    rms = RMS_OF_RATED * rig.values.get("valve.rated_command_v", 10.0)
    return multisine(SAMPLES, DT_S, band_hz=BAND_HZ, rms=rms, rng=rng)


def trim(rig: Rig, command: FloatArray) -> float:
    """Constant that brings the rod back to its start.

    A cylinder of unequal areas extends faster than it retracts: a command without a mean drifts to
    an end of the stroke within a minute.
    """
    if rig.plant != "ehs":
        return 0.0

    def drift(constant: float) -> float:
        position = simulate(rig, command + constant, dt_s=DT_S).record.column("position_m")
        return float(position[-1] - position[0])

    widest = float(np.std(command))
    return float(brentq(drift, -widest, widest, xtol=1e-4 * widest))


def rig_record(rig: Rig, seed: int) -> RigRecord:
    """One record from rest at mid-stroke, with the noise that the rig tells of its sensors.

    Raises
    ------
    SimulationError
        a rig that cannot be simulated, or that reaches an end of its stroke all the same.
    """
    rng = np.random.default_rng(seed)
    command = excitation_of(rig, rng)
    constant = trim(rig, command)
    run = simulate(
        rig,
        command + constant,
        dt_s=DT_S,
        keep_inside=True,
        noise=draw_noise(rig, SAMPLES, rng),
        name=f"{rig.name}, seed {seed}",
    )
    return RigRecord(run.record, constant)


def changed_record(rig: Rig, change: Mapping[str, float], seed: int) -> RigRecord:
    """The same, with other values of the rig from the middle of the record on.

    The second half starts from the state in which the first ends.
    """
    whole = rig_record(rig, seed)
    half = SAMPLES // 2
    first = {name: whole.record.column(name) for name in whole.record.columns}
    start = prepare(rig, dt_s=DT_S, values=change)
    # Over the samples before, the changed rig is led along the states of the first one, so that
    # spool and delay line are where the command has brought them.
    led = slice(half - LEAD, half + 1)
    aligned = np.full((SAMPLES - half + LEAD, len(STATES)), np.nan)
    aligned[: LEAD + 1] = np.column_stack(
        [first.get(name, np.full(SAMPLES, np.nan))[led] for name in STATES]
    )
    outputs, _ = ehsid.simulate_plant(
        rig.plant,
        start.plant_values[np.newaxis],
        first["command_v"][half - LEAD :],
        dt_s=DT_S,
        substeps=start.substeps,
        aligned=aligned,
    )
    noise = draw_noise(rig, SAMPLES - half, np.random.default_rng([seed, 1]))
    after = columns_of(rig.plant, as_measured(outputs[0, LEAD:], noise, start.told))
    columns = {
        name: np.concatenate([values[:half], after.get(name, values)[-(SAMPLES - half) :]])
        for name, values in first.items()
    }
    columns["time_s"] = np.arange(SAMPLES) * DT_S
    return RigRecord(make_record(columns, name=f"{rig.name}, changed, seed {seed}"), whole.trim_v)
