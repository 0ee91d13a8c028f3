# SPDX-License-Identifier: MIT
"""Records of a simulated rig: 100 s, sampled every 50 ms, with the rod inside its stroke."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import brentq

import ehsid
from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate
from ehsid.harness.signals.simulation.outputs import as_measured, columns_of
from ehsid.harness.signals.simulation.run import prepare
from ehsid.harness.signals.simulation.windows import STATES

from .published import DT_S, DURATION_S

SAMPLES = round(DURATION_S / DT_S)
BAND_HZ = (0.05, 5.0)
# Rms of the command as a share of the rated command. It is small enough that the orifices are
# nearly linear, and large compared with the range around null.
RMS_OF_RATED = 0.1
# Samples before the change over which the changed rig is held to the states of the first half.
LEAD = 5


def excitation_of(rig: Rig, rng: np.random.Generator) -> FloatArray:
    """Returns a random-phase multisine in V with an rms of a tenth of the rated command.

    The shape is (2000,), the mean zero.
    """
    rms = RMS_OF_RATED * rig.values.get("valve.rated_command_v", 10.0)
    return multisine(SAMPLES, DT_S, band_hz=BAND_HZ, rms=rms, rng=rng)


def trim(rig: Rig, command: FloatArray) -> float:
    """Returns the constant in V which, added to the command, brings the rod back to its start.

    A cylinder with unequal areas extends faster than it retracts: under a command with zero mean,
    the rod drifts to an end of the stroke within a minute.
    """
    if rig.plant != "ehs":
        return 0.0

    def drift(constant: float) -> float:
        position = simulate(rig, command + constant, dt_s=DT_S).record.column("position_m")
        return float(position[-1] - position[0])

    widest = float(np.std(command))
    return float(brentq(drift, -widest, widest, xtol=1e-4 * widest))


def rig_record(rig: Rig, seed: int) -> Record:
    """Simulates one record from rest at mid-stroke, with the sensor noise of the rig file.

    Raises
    ------
    SimulationError
        the rig cannot be simulated, or reaches an end of its stroke despite the added constant.
    """
    rng = np.random.default_rng(seed)
    command = excitation_of(rig, rng)
    return simulate(
        rig,
        command + trim(rig, command),
        dt_s=DT_S,
        keep_inside=True,
        noise=draw_noise(rig, SAMPLES, rng),
        name=f"{rig.name}, seed {seed}",
    ).record


def changed_record(rig: Rig, change: Mapping[str, float], seed: int) -> Record:
    """Simulates a record like `rig_record`, with changed rig values in its second half.

    The second half starts from the state in which the first half ends.
    """
    whole = rig_record(rig, seed)
    half = SAMPLES // 2
    first = {name: whole.column(name) for name in whole.columns}
    start = prepare(rig, dt_s=DT_S, values=change)
    # Over the last samples before the change, the states of the changed rig are set to those of the
    # first half. The spool and the delay line, which are not recorded, then follow the command.
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
    after = columns_of(rig.plant, as_measured(outputs[0, LEAD:], noise, start.values))
    columns = {
        name: np.concatenate([values[:half], after.get(name, values)[-(SAMPLES - half) :]])
        for name, values in first.items()
    }
    columns["time_s"] = np.arange(SAMPLES) * DT_S
    return make_record(columns, name=f"{rig.name}, changed, seed {seed}")
