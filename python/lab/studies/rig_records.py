# SPDX-License-Identifier: MIT
"""Records of a simulated rig: 100 s, sampled every 50 ms, with the rod inside its stroke.

Figures of the published experiment, for comparison with our results, not as targets.

R. Ghazali, Y. M. Sam, M. F. Rahmat, Zulfatman, "Recursive parameter estimation for discrete-time
model of an electro-hydraulic servo system with varying forgetting factor", International Journal
of Physical Sciences 6(30), 2011, pp. 6829-6842.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate
from ehsid.harness.signals.simulation.run import as_measured, columns_of, prepare
from ehsid.harness.signals.simulation.windows import STATES

SOURCE = (
    "R. Ghazali, Y. M. Sam, M. F. Rahmat, Zulfatman, Int. J. Physical Sciences 6(30), 2011, "
    "pp. 6829-6842"
)

DT_S = 0.05
"""Sampling time of the experiment in seconds."""

DURATION_S = 100.0
"""Length of its record in seconds; one half is for estimation, the other for validation."""

MODEL_16 = (-2.2390, 1.7820, -0.5427, 0.3850, -0.5810, 0.2954)
"""Eq. (16), the identified model: a1, a2, a3, b1, b2, b3; na = nb = 3, nk = 1."""


@dataclass(frozen=True)
class PublishedOrder:
    """One row of the paper's table of model orders."""

    order: int
    fit_percent: float
    fpe: float
    loss: float


ORDERS = (
    PublishedOrder(2, 91.27, 0.0325882, 0.0323295),
    PublishedOrder(3, 95.48, 0.0230747, 0.0228011),
    PublishedOrder(4, 95.53, 0.0217047, 0.0213629),
    PublishedOrder(5, 95.51, 0.0215606, 0.0211378),
)


@dataclass(frozen=True)
class PublishedRun:
    """One column of the paper's table of recursive estimates: final parameters and RMSE."""

    theta: tuple[float, ...]
    rmse: float


RECURSIVE = {
    "varying": PublishedRun((-2.2553, 1.8098, -0.5545, 0.3753, -0.5660, 0.2878), 0.1817),
    "0.99": PublishedRun((-2.2502, 1.8148, -0.5642, 0.3760, -0.5694, 0.2924), 0.3878),
    "1": PublishedRun((-2.2020, 1.6833, -0.4813, 0.0344, 0.1058, -0.0678), 0.6967),
}
"""Final parameters and RMSE with varying forgetting factor, lambda = 0.99 and lambda = 1."""


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
