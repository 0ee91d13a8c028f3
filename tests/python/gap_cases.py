# SPDX-License-Identifier: MIT
"""What the tests of the fits share: a rig with sensors, records of it, cases of these."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from servo_records import BENCH
from sources import ROOT

import ehsid
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.rig import TableLaw
from ehsid.harness.signals.excitation import multisine, triangle
from ehsid.harness.signals.simulation import draw_noise, simulate

FloatArray = npt.NDArray[np.float64]

RIGS = ROOT / "examples" / "rigs"
DT_S = 2e-3
# Of the records: finer than any fit.
SUBSTEPS = 16
PRESSURES = ("position_m", "pressure_a_pa", "pressure_b_pa")
NOISE = {"position_noise_m": 5e-6, "pressure_a_noise_pa": 1e4, "pressure_b_noise_pa": 1e4}
RIG = Rig("bench", "ehs", BENCH.values, sensors=NOISE)
# Within the uncertainty that the rig tells, as any real one is.
OFF = {"fluid.bulk_modulus_pa": 0.9e9, "load.viscous_friction_n_s_m": 1100.0}


def command_of(seconds: float, dt_s: float, rng: np.random.Generator) -> FloatArray:
    """Multisine past the oil spring, then a slow triangle: load of both signs, slow and fast."""
    half = round(0.5 * seconds / dt_s)
    fast = multisine(half, dt_s, band_hz=(0.5, min(25.0, 0.4 / dt_s)), rms=2.0, rng=rng)
    return np.concatenate([fast, triangle(half, dt_s, amplitude=0.8, period_s=1.0)])


def measured(
    rig: Rig,
    command: FloatArray,
    rng: np.random.Generator,
    values: Mapping[str, float],
    names: tuple[str, ...] = PRESSURES,
    dt_s: float = DT_S,
) -> Record:
    """The rig with these values, with the noise of its sensors."""
    noise = draw_noise(rig, command.size, rng)
    run = simulate(rig, command, dt_s=dt_s, values=dict(values), substeps=SUBSTEPS, noise=noise)
    columns = {name: run.record.column(name) for name in ("command_v", *names)}
    return make_record({"time_s": run.record.time_s, **columns})


def record(
    values: Mapping[str, float],
    seed: int,
    names: tuple[str, ...] = PRESSURES,
    *,
    seconds: float = 4.0,
    dt_s: float = DT_S,
) -> Record:
    rng = np.random.default_rng(seed)
    return measured(RIG, command_of(seconds, dt_s, rng), rng, values, names, dt_s)


def over_the_stroke(
    tables: Mapping[str, TableLaw],
    seed: int,
    values: Mapping[str, float] | None = None,
    seconds: float = 6.0,
) -> Record:
    """The rig with these laws and values, over most of the stroke and back, with pressures."""
    rng = np.random.default_rng(seed)
    command = command_of(seconds, DT_S, rng)
    command += 4.0 * np.cos(np.pi * DT_S * np.arange(command.size))
    return measured(replace(RIG, tables=tables), command, rng, {**OFF, **(values or {})})


def case_of(
    values: Mapping[str, float], names: tuple[str, ...] = PRESSURES, seconds: float = 4.0
) -> Case:
    """One record to fit, one that is held out."""
    fitted, held_out = (record(values, seed, names, seconds=seconds) for seed in (1, 2))
    return make_case(RIG, [fitted], [held_out])


def all_but(*effects: str) -> tuple[str, ...]:
    """What to exclude so that only these are tried."""
    return tuple(info.id for info in ehsid.effects() if info.id not in effects)
