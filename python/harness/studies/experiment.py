# SPDX-License-Identifier: MIT
"""Functions that run the parts of the recursive experiment and return typed findings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ehsid.harness.identification import ArxModel, ArxOrders
from ehsid.harness.identification.loop import LoopAnalysis, analyse_loop
from ehsid.harness.identification.systems import arx_system
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.studies.claims import (
    Input,
    Judged,
    ResetJudged,
    map_claims,
    map_resets,
)
from ehsid.harness.studies.comparison import Samples, Setting, run_contender
from ehsid.harness.studies.published import DT_S, MODEL_16, RECURSIVE
from ehsid.harness.studies.reading import Reading, RigReading, read_over_time, read_rig_values
from ehsid.harness.studies.recursive import (
    CONTENDERS,
    Changed,
    Recursive,
    noise_for_fit,
    on_changed_plant,
    on_changed_rig,
    on_known_plant,
    on_rig,
    setting_of,
)
from ehsid.harness.studies.sampled_servo import SampledServo, sample_again
from ehsid.harness.studies.verdicts import ClaimVerdict, verdicts

VAGUE = 1e6
TRUSTED = 1e-2
READER = CONTENDERS["varying, Eq. (15)"]
P0S = (1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6)
NOISES = (0.003, 0.01, 0.03, 0.1, 0.151, 0.5)
LAMBDA0S = (0.9, 0.95, 0.98, 0.99, 0.995, 0.998)
FACTORS = (0.5, 1.25, 1.5, 2.0, 3.0)
# Paired runs in each cell of a map. With 24 runs, a sign test at the level of 5 % finds a
# difference if seven in ten runs lie on one side.
RUNS_A_CELL = 24

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class KnownPlantFindings:
    """Findings of part (a), with model (16) as the known plant.

    Attributes
    ----------
    noise
        standard deviation of e(k) for which the offline model has the fit of the paper's model.
    runs
        one Recursive for each start: the vague start and that of `start_of_one`.
    changed
        runs in which all b parameters grow by half at half of the record.
    loop
        analysis of proportional control of model (16).
    """

    noise: float
    runs: tuple[Recursive, ...]
    changed: Changed
    loop: LoopAnalysis


@dataclass(frozen=True, eq=False)
class ClaimFindings:
    """Maps of the claims, and the verdicts derived from them.

    Attributes
    ----------
    start_of_one
        P0 at which lambda = 1 has the same error after 100 s as the paper's column.
    error_of_one
        relative error of the paper's column for lambda = 1 against model (16).
    """

    judged: tuple[Judged, ...]
    resets: tuple[ResetJudged, ...]
    verdicts: tuple[ClaimVerdict, ...]
    start_of_one: float
    error_of_one: float


@dataclass(frozen=True, eq=False)
class RigFindings:
    """Findings of part (b), on a rig with its offline model as the reference.

    Attributes
    ----------
    setting
        orders of the model and scaling of the record.
    runs
        one Recursive for each start.
    changed, change
        runs in which the rig values change at half of the record, and the changed values.
    reading, rig_reading
        K, omega_n and xi over the reference record, and the rig values computed from them.
    sampled
        the servo of the last valid reading, sampled again.
    """

    setting: Setting
    runs: tuple[Recursive, ...]
    changed: Changed
    change: Mapping[str, float]
    reading: Reading
    rig_reading: RigReading | None
    sampled: SampledServo | None


def published_error_of_one() -> float:
    """Returns |theta_hat - theta| / |theta| of the paper's lambda = 1 column against model (16)."""
    truth = np.array(MODEL_16)
    return float(np.linalg.norm(np.array(RECURSIVE["1"].theta) - truth) / np.linalg.norm(truth))


def start_of_one(judged: tuple[Judged, ...], noise: float, error: float) -> float:
    """Returns the P0 at which the median error of lambda = 1 after 100 s equals `error`.

    The value is interpolated linearly over log P0 between the starts of the map, for the multisine
    and the noise of the map that is nearest to `noise`.
    """
    nearest = min({cell.condition.noise for cell in judged}, key=lambda n: abs(n - noise))
    curve = {
        cell.condition.p0: cell.error_of_one.median
        for cell in judged
        if cell.condition.input is Input.multisine and cell.condition.noise == nearest
    }
    p0s = np.array(sorted(curve))
    errors = np.array([curve[p0] for p0 in p0s])
    # np.interp requires rising abscissae, and the error falls with P0.
    return float(10.0 ** np.interp(-error, -errors, np.log10(p0s)))


def judge_claims(noise: float, progress: Progress) -> ClaimFindings:
    """Computes the maps on model (16) and the start that explains the paper's lambda = 1."""
    judged = tuple(
        map_claims(
            p0s=P0S,
            noises=NOISES,
            inputs=tuple(Input),
            lambda0s=LAMBDA0S,
            seeds=range(RUNS_A_CELL),
            progress=lambda share: progress("maps of the claims", share),
        )
    )
    resets = tuple(
        map_resets(
            noises=NOISES,
            factors=FACTORS,
            seeds=range(RUNS_A_CELL),
            progress=lambda share: progress("map of the reset", share),
        )
    )
    error = published_error_of_one()
    return ClaimFindings(
        judged, resets, tuple(verdicts(judged, resets)), start_of_one(judged, noise, error), error
    )


def run_on_known_plant(
    runs: int, claims: ClaimFindings, noise: float, progress: Progress
) -> KnownPlantFindings:
    """Runs part (a) on model (16), with seeds 0 to runs - 1."""
    seeds = range(runs)
    found = tuple(
        on_known_plant(
            seeds,
            p0=p0,
            noise=noise,
            progress=lambda share: progress("runs on model (16)", share),
        )
        for p0 in (VAGUE, claims.start_of_one)
    )
    changed = on_changed_plant(
        seeds, p0=VAGUE, progress=lambda share: progress("changes of model (16)", share)
    )
    loop = analyse_loop(arx_system(ArxOrders(3, 3, 1), MODEL_16, DT_S))
    return KnownPlantFindings(noise, found, changed, loop)


def run_on_rig(
    rig: Rig,
    record: Record,
    model: ArxModel,
    change: Mapping[str, float],
    runs: int,
    progress: Progress,
) -> RigFindings:
    """Runs part (b) on the rig, with seeds 0 to runs - 1.

    `record` and `model` are the record of the offline procedure and the model identified from it.
    """
    samples = record.column("command_v"), record.column("position_m")
    setting = setting_of(samples, model.orders)
    seeds = range(runs)
    found = on_rig(
        rig,
        model,
        setting,
        seeds,
        p0s=(VAGUE, TRUSTED),
        progress=lambda share: progress("runs on the rig", share),
    )
    changed = on_changed_rig(
        rig,
        model,
        setting,
        change,
        seeds,
        progress=lambda share: progress("changes of the rig", share),
    )
    reading = read_over_time(samples, setting, READER, DT_S)
    return RigFindings(
        setting,
        tuple(found),
        changed,
        change,
        reading,
        read_rig_values(reading, rig, float(np.mean(samples[1]))),
        sample_again(reading, DT_S),
    )


@dataclass(frozen=True, eq=False)
class RecordFindings:
    """Findings on a user's own record, in a single run, since it cannot be drawn again.

    Attributes
    ----------
    setting
        orders of the model and scaling of the record.
    runs
        one Recursive for each start; the reference is the offline model.
    reading, rig_reading, sampled
        as in RigFindings; None if the structure of the model or an unknown sampling time does not
        allow the reading. rig_reading is also None without a rig.
    """

    setting: Setting
    runs: tuple[Recursive, ...]
    reading: Reading | None
    rig_reading: RigReading | None
    sampled: SampledServo | None


def run_on_record(
    samples: Samples, model: ArxModel, dt_s: float | None, rig: Rig | None
) -> RecordFindings:
    """Runs all contenders on one record of N samples and compares them with its offline model."""
    setting = setting_of(samples, model.orders)
    truth = np.tile(model.theta, (samples[0].size, 1))
    runs = tuple(
        Recursive(
            p0,
            {
                name: run_contender(contender, [samples], truth, replace(setting, p0=p0))
                for name, contender in CONTENDERS.items()
            },
        )
        for p0 in (VAGUE, TRUSTED)
    )
    orders = model.orders
    if dt_s is None or (orders.na, orders.nb, orders.nk) != (3, 3, 1):
        return RecordFindings(setting, runs, None, None, None)
    reading = read_over_time(samples, setting, READER, dt_s)
    middle = float(np.mean(samples[1]))
    rig_reading = None if rig is None else read_rig_values(reading, rig, middle)
    return RecordFindings(setting, runs, reading, rig_reading, sample_again(reading, dt_s))


__all__ = [
    "ClaimFindings",
    "KnownPlantFindings",
    "RecordFindings",
    "RigFindings",
    "judge_claims",
    "noise_for_fit",
    "run_on_known_plant",
    "run_on_record",
    "run_on_rig",
]
