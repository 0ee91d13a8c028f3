# SPDX-License-Identifier: MIT
"""Functions that run the parts of the recursive experiment and return typed findings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ehsid.harness.models.identification import ArxModel
from ehsid.harness.models.identification.loop import LoopAnalysis, analyse_loop, arx_system
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

from .claims import ORDERS, Input, Judged, ResetJudged, map_claims, map_resets
from .comparison import Samples, Setting, run_contender
from .linearisation import SampledServo, sample_again
from .reading import Reading, RigReading, read_over_time, read_rig_values
from .recursive import (
    CONTENDERS,
    Changed,
    Recursive,
    on_changed_plant,
    on_changed_rig,
    on_known_plant,
    on_rig,
    setting_of,
)
from .rig_records import DT_S, MODEL_16, RECURSIVE
from .verdicts import ClaimVerdict, verdicts

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
class KnownPlantResults:
    """Findings of part (a), with model (16) as the known plant."""

    noise: float
    """Standard deviation of e(k) for which the offline model has the fit of the paper's model."""
    runs: Sequence[Recursive]
    """One Recursive for each start: the vague start and that of `start_of_one`."""
    changed: Changed
    """Runs in which all b parameters grow by half at half of the record."""
    loop: LoopAnalysis
    """Analysis of proportional control of model (16)."""


@dataclass(frozen=True, eq=False)
class ClaimResults:
    """Maps of the claims, and the verdicts derived from them."""

    judged: Sequence[Judged]
    resets: Sequence[ResetJudged]
    verdicts: Sequence[ClaimVerdict]
    start_of_one: float
    """P0 at which the error of lambda = 1 after 100 s is as large as that of the paper's column."""
    error_of_one: float
    """Relative error of the paper's column for lambda = 1 against model (16)."""


@dataclass(frozen=True, eq=False)
class ServoReading:
    """Physical parameters read from the estimates over a record."""

    reading: Reading
    """K, omega_n and xi over time."""
    rig: RigReading | None
    """The rig values computed from them; None without a rig or a valid reading."""
    sampled: SampledServo | None
    """The servo of the last valid reading, sampled again; None if there is none."""

    @classmethod
    def of(cls, samples: Samples, setting: Setting, dt_s: float, rig: Rig | None) -> ServoReading:
        """Runs the varying factor over a record and reads the servo of a rig, if it is known."""
        reading = read_over_time(samples, setting, READER, dt_s)
        values = None if rig is None else read_rig_values(reading, rig, float(np.mean(samples[1])))
        return cls(reading, values, sample_again(reading, dt_s))


@dataclass(frozen=True, eq=False)
class RigResults:
    """Findings of part (b), on a rig with its offline model as the reference."""

    runs: Sequence[Recursive]
    """One Recursive for each start."""
    changed: Changed
    change: Mapping[str, float]
    """Runs in which the rig values change at half of the record, and the changed values."""
    servo: ServoReading
    """What the estimates over the reference record say of the servo."""


def published_error_of_one() -> float:
    """Returns |theta_hat - theta| / |theta| of the paper's lambda = 1 column against model (16)."""
    truth = np.array(MODEL_16)
    return float(np.linalg.norm(np.array(RECURSIVE["1"].theta) - truth) / np.linalg.norm(truth))


def same_direction(known: KnownPlantResults) -> float:
    """Returns whether lambda = 1 from the start `start_of_one` errs as the paper's column does.

    It is the cosine of the angle between both errors against model (16): 1 where they have the
    same direction, near 0 where they are in other parameters.
    """
    truth = np.array(MODEL_16)
    ours = np.median(known.runs[-1].outcomes["1"].theta, axis=0) - truth
    published = np.array(RECURSIVE["1"].theta) - truth
    return float(ours @ published / (np.linalg.norm(ours) * np.linalg.norm(published)))


def start_of_one(judged: Sequence[Judged], noise: float, error: float) -> float:
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


def judge_claims(noise: float, progress: Progress) -> ClaimResults:
    """Computes the maps on model (16) and the start of an error as large as the published."""
    judged = map_claims(
        p0s=P0S,
        noises=NOISES,
        inputs=tuple(Input),
        lambda0s=LAMBDA0S,
        seeds=range(RUNS_A_CELL),
        progress=partial(progress, "maps of the claims"),
    )
    resets = map_resets(
        noises=NOISES,
        factors=FACTORS,
        seeds=range(RUNS_A_CELL),
        progress=partial(progress, "map of the reset"),
    )
    error = published_error_of_one()
    return ClaimResults(
        judged, resets, verdicts(judged, resets), start_of_one(judged, noise, error), error
    )


def run_on_known_plant(
    runs: int, claims: ClaimResults, noise: float, progress: Progress
) -> KnownPlantResults:
    """Runs part (a) on model (16), with seeds 0 to runs - 1."""
    seeds = range(runs)
    known = [
        on_known_plant(seeds, p0=p0, noise=noise, progress=partial(progress, "runs on model (16)"))
        for p0 in (VAGUE, claims.start_of_one)
    ]
    changed = on_changed_plant(seeds, p0=VAGUE, progress=partial(progress, "changes of model (16)"))
    loop = analyse_loop(arx_system(ORDERS, MODEL_16, DT_S))
    return KnownPlantResults(noise, known, changed, loop)


def run_on_rig(
    rig: Rig,
    record: Record,
    model: ArxModel,
    change: Mapping[str, float],
    runs: int,
    progress: Progress,
) -> RigResults:
    """Runs part (b) on the rig, with seeds 0 to runs - 1.

    `record` and `model` are the record of the offline procedure and the model identified from it.
    """
    samples = record.column("command_v"), record.column("position_m")
    setting = setting_of(samples, model.orders)
    seeds = range(runs)
    return RigResults(
        on_rig(
            rig,
            model,
            setting,
            seeds,
            p0s=(VAGUE, TRUSTED),
            progress=partial(progress, "runs on the rig"),
        ),
        on_changed_rig(
            rig, model, setting, change, seeds, progress=partial(progress, "changes of the rig")
        ),
        change,
        ServoReading.of(samples, setting, DT_S, rig),
    )


@dataclass(frozen=True, eq=False)
class RecordResults:
    """Findings on a user's own record, in a single run, since it cannot be drawn again."""

    runs: Sequence[Recursive]
    """One Recursive for each start; the reference is the offline model."""
    servo: ServoReading | None
    """As in RigResults; None if the structure of the model or an unknown sampling time does not
    allow the reading."""


def run_on_record(
    samples: Samples, model: ArxModel, dt_s: float | None, rig: Rig | None
) -> RecordResults:
    """Runs all contenders on one record of N samples and compares them with its offline model."""
    setting = setting_of(samples, model.orders)
    truth = np.tile(model.theta, (samples[0].size, 1))
    runs = [
        Recursive(
            p0,
            {
                name: run_contender(contender, [samples], truth, replace(setting, p0=p0))
                for name, contender in CONTENDERS.items()
            },
        )
        for p0 in (VAGUE, TRUSTED)
    ]
    orders = model.orders
    if dt_s is None or (orders.na, orders.nb, orders.nk) != (3, 3, 1):
        return RecordResults(runs, None)
    return RecordResults(runs, ServoReading.of(samples, setting, dt_s, rig))
