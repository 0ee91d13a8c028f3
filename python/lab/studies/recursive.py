# SPDX-License-Identifier: MIT
"""The recursive part of the experiment: compares forgetting policies over many parallel runs.

Part (a) uses model (16) as the known plant. Part (b) uses a nonlinear rig, with the offline model
as the reference, as in the paper. All policies start from the same state. Further runs change the
plant at half of the record, without and with the reset of Fig. 4.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import brentq

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import Progress, run_tasks
from ehsid.harness.models.identification import (
    ArxModel,
    ArxOrders,
    IoData,
    fit_arx,
    fit_percent,
    simulate,
)
from ehsid.harness.rigs import Rig

from .claims import ORDERS, SAMPLES, Input, excite
from .comparison import (
    PLAIN,
    Contender,
    KnownPlant,
    Outcome,
    Samples,
    Setting,
    joined,
    known_records,
    run_contender,
)
from .rig_records import MODEL_16, changed_record, rig_record
from .rig_records import ORDERS as PUBLISHED_ORDERS

CHANGE = SAMPLES // 2
# Factor on all b parameters of the known plant at the change.
B_AFTER = 1.5
# Standard deviation of e(k) in the runs with a change. At the noise of the published fit, the
# change only doubles the prediction error, but the reset fires at a factor of three.
QUIET_NOISE = 0.01
PUBLISHED_FIT = next(row.fit_percent for row in PUBLISHED_ORDERS if row.order == 3)
RUNS_A_TASK = 10

PLANT = KnownPlant.of(ORDERS, MODEL_16)
RecordOf = Callable[[int], Samples]  # makes the record of a seed
Variant = tuple[Setting, bool]  # whether the reset is on

CONTENDERS: Mapping[str, Contender] = {
    "varying, Eq. (15)": Contender(ehsid.Exponential(), options=PLAIN),
    "0.99": Contender(ehsid.Constant(0.99), options=PLAIN),
    "1": Contender(ehsid.Constant(1.0), options=PLAIN),
    "F-ratio (default)": Contender(ehsid.FRatio()),
}


@dataclass(frozen=True, eq=False)
class Recursive:
    """Results of all contenders, by name, over all runs from the start P(0) = p0 I."""

    p0: float
    outcomes: Mapping[str, Outcome]


@dataclass(frozen=True, eq=False)
class Changed:
    """Results with a change of the plant at sample `at`: (without reset, with reset) by name."""

    at: int
    outcomes: Mapping[str, tuple[Outcome, Outcome]]


def noise_for_fit() -> float:
    """Returns the standard deviation of e(k) at which the offline model fits as published.

    A third-order model of a record of model (16) is identified from the first half. The fit is that
    of its simulated output on the second half, as in Fig. 7, as the median over the seeds. The
    one-step fit of model (16) never falls to the paper's figure: its integrator sums the noise, and
    a large slow output is easy to predict.
    """

    def beyond(noise: float) -> float:
        fits = []
        for u, y in known_records(PLANT, partial(excite, Input.multisine), noise, range(8)):
            estimation, validation = IoData.from_arrays(u, y).split(0.5)
            simulated = simulate(fit_arx(estimation, ORDERS), validation)
            fits.append(fit_percent(simulated.measured, simulated.predicted))
        return float(np.median(fits)) - PUBLISHED_FIT

    return float(brentq(beyond, 1e-4, 0.03, xtol=1e-5))


def setting_of(samples: Samples, orders: ArxOrders) -> Setting:
    """Returns a setting that scales both signals by their standard deviations about their means."""
    u, y = samples
    return Setting(
        orders,
        p0=1e6,
        command_scale=float(np.std(u)),
        position_scale=float(np.std(y)),
        command_offset=float(np.mean(u)),
        position_offset=float(np.mean(y)),
    )


def on_known_plant(
    seeds: Sequence[int], *, p0: float, noise: float, progress: Progress | None = None
) -> Recursive:
    """Runs all contenders on model (16) as the known plant, with one run for each seed."""
    record_of = partial(_known_record, PLANT, noise)
    variants = [(Setting(ORDERS, p0=p0), False)]
    truth = PLANT.theta_path(SAMPLES)
    return Recursive(p0, _in_parallel(record_of, truth, variants, seeds, progress)[0])


def on_changed_plant(
    seeds: Sequence[int], *, p0: float = 1e6, progress: Progress | None = None
) -> Changed:
    """Runs all contenders on model (16), whose b parameters grow by half at half of the record."""
    factors = np.where(np.arange(ORDERS.n_parameters) < ORDERS.na, 1.0, B_AFTER)
    plant = PLANT.changed(CHANGE, np.array(MODEL_16) * factors)
    record_of = partial(_known_record, plant, QUIET_NOISE)
    setting = Setting(ORDERS, p0=p0)
    return _changed(record_of, plant.theta_path(SAMPLES), setting, seeds, progress)


def on_rig(
    rig: Rig,
    reference: ArxModel,
    setting: Setting,
    seeds: Sequence[int],
    *,
    p0s: Sequence[float],
    progress: Progress | None = None,
) -> list[Recursive]:
    """Runs all contenders on the rig, for several starts P(0) = p0 I, one record for each seed.

    The argument `reference` is the offline model of the rig.
    """
    truth = np.tile(reference.theta, (SAMPLES, 1))
    variants = [(replace(setting, p0=p0), False) for p0 in p0s]
    results = _in_parallel(partial(_rig_record, rig), truth, variants, seeds, progress)
    return [Recursive(p0, outcomes) for p0, outcomes in zip(p0s, results, strict=True)]


def on_changed_rig(
    rig: Rig,
    reference: ArxModel,
    setting: Setting,
    change: Mapping[str, float],
    seeds: Sequence[int],
    *,
    progress: Progress | None = None,
) -> Changed:
    """Runs all contenders on a rig, some of whose values change at half of the record.

    After the change, the reference is the offline model of the changed rig, of the same structure.
    """
    changed = rig_record(rig.with_values(change), seeds[0])
    after = fit_arx(IoData.from_record(changed, "command_v", "position_m"), reference.orders)
    truth = np.repeat(np.stack([reference.theta, after.theta]), CHANGE, axis=0)
    return _changed(partial(_changed_rig_record, rig, change), truth, setting, seeds, progress)


def _known_record(plant: KnownPlant, noise: float, seed: int) -> Samples:
    return known_records(plant, partial(excite, Input.multisine), noise, [seed])[0]


def _rig_record(rig: Rig, seed: int) -> Samples:
    record = rig_record(rig, seed)
    return record.column("command_v"), record.column("position_m")


def _changed_rig_record(rig: Rig, change: Mapping[str, float], seed: int) -> Samples:
    record = changed_record(rig, change, seed)
    return record.column("command_v"), record.column("position_m")


def _changed(
    record_of: RecordOf,
    truth: FloatArray,
    setting: Setting,
    seeds: Sequence[int],
    progress: Progress | None,
) -> Changed:
    variants = [(setting, False), (setting, True)]
    without, with_reset = _in_parallel(record_of, truth, variants, seeds, progress)
    return Changed(CHANGE, {name: (without[name], with_reset[name]) for name in CONTENDERS})


def _in_parallel(
    record_of: RecordOf,
    truth: FloatArray,
    variants: Sequence[Variant],
    seeds: Sequence[int],
    progress: Progress | None,
) -> list[dict[str, Outcome]]:
    """Returns the outcomes by contender for each variant, one run for each seed."""
    groups = [seeds[first : first + RUNS_A_TASK] for first in range(0, len(seeds), RUNS_A_TASK)]
    tasks = [partial(_run_group, record_of, truth, variants, group) for group in groups]
    parts = run_tasks(tasks, progress)
    return [
        {name: joined([part[i][name] for part in parts]) for name in CONTENDERS}
        for i in range(len(variants))
    ]


def _run_group(
    record_of: RecordOf, truth: FloatArray, variants: Sequence[Variant], seeds: Sequence[int]
) -> list[dict[str, Outcome]]:
    records = [record_of(seed) for seed in seeds]
    return [
        {
            name: run_contender(replace(contender, reset=reset), records, truth, setting)
            for name, contender in CONTENDERS.items()
        }
        for setting, reset in variants
    ]
