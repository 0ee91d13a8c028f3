# SPDX-License-Identifier: MIT
"""Compares a start from an offline model with a vague start, on model (16) as the known plant."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.firmware.seeding import configure_from_record
from ehsid.harness.models.identification import IoData

from . import MODEL_16, KnownPlant
from .claims import ORDERS, SAMPLES, Input, excite
from .comparison import Samples, known_records, settling

ALL = slice(None)
B = slice(ORDERS.na, None)
# Added to the seed of a run, so that its offline record is drawn independently of its online one.
OFFLINE_SEEDS = 1_000_000


@dataclass(frozen=True, eq=False)
class Starts:
    """Parameter errors of the seeded and of the vague start on the same records.

    Attributes
    ----------
    seeded, vague
        shape (runs, N), relative error |theta_hat - theta| / |theta| after each sample, of the
        scaled parameters that were selected.
    """

    seeded: FloatArray
    vague: FloatArray

    def settled(
        self, tolerance: float = 0.05, start: int = 0
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Returns for both starts the settling times in samples after `start`, shape (runs,)."""
        return settling(self.seeded, tolerance, start), settling(self.vague, tolerance, start)


def _errors(
    configurations: Sequence[EstimatorConfiguration],
    records: Sequence[Samples],
    truth: FloatArray,
    judged: slice,
) -> FloatArray:
    """Runs each estimator over its record; returns their errors, shape (runs, N)."""
    bank = ehsid.EstimatorBank([one.estimator() for one in configurations])
    u, y = (np.column_stack(columns) for columns in zip(*records, strict=True))
    path = bank.run(np.float32(u), np.float32(y))
    errors = []
    for i, configuration in enumerate(configurations):
        theta = path.theta[:, i].astype(np.float64)
        scaling = configuration.scaling
        gain = scaling.command_scale / scaling.position_scale
        weights = np.array([1.0] * ORDERS.na + [gain] * ORDERS.nb)
        size = np.linalg.norm((truth * weights)[:, judged], axis=1)
        errors.append(np.linalg.norm(((theta - truth) * weights)[:, judged], axis=1) / size)
    return np.stack(errors)


def compare_starts(
    forgetting: ehsid.Forgetting,
    seeds: Iterable[int],
    *,
    noise: float,
    model_b: float = 1.0,
    inflation: float | None = None,
    change: tuple[int, float] | None = None,
    judged: slice = ALL,
) -> Starts:
    """Estimates model (16) from a seeded and from a vague start, with one run for each seed.

    The seed of the estimator is the offline model of the first 50 s of another record.

    Parameters
    ----------
    forgetting
        forgetting policy of the estimator.
    seeds
        random seeds, one run for each.
    noise
        standard deviation of the equation error e(k).
    model_b
        factor on the b parameters of the offline model before it is used; 1 leaves the model as
        identified.
    inflation
        factor on the covariance of the offline model, as in `configure_from_record`.
    change
        (k, factor): from sample k on, the b parameters of the plant are multiplied by the factor.
    judged
        parameters whose error is returned: `ALL`, or `B`, which are small compared with the a.
    """
    plant = KnownPlant.of(ORDERS, MODEL_16)
    running = plant
    if change is not None:
        at, factor = change
        running = plant.changed(at, np.array(MODEL_16) * _on_b(factor))
    seeds = list(seeds)
    excited = partial(excite, Input.multisine)
    truth = running.theta_path(SAMPLES)
    offline = known_records(plant, excited, noise, [OFFLINE_SEEDS + seed for seed in seeds])
    online = known_records(running, excited, noise, seeds)
    started = []
    for u, y in offline:
        half = IoData.from_arrays(u[: SAMPLES // 2], y[: SAMPLES // 2])
        made = configure_from_record(half, ORDERS, forgetting=forgetting, inflation=inflation)
        seed = made.configuration.seed
        assert seed is not None
        used = replace(seed, theta=seed.theta * _on_b(model_b))
        started.append(replace(made.configuration, seed=used))
    return Starts(
        _errors(started, online, truth, judged),
        _errors([replace(one, seed=None) for one in started], online, truth, judged),
    )


def _on_b(factor: float) -> FloatArray:
    return np.where(np.arange(ORDERS.n_parameters) < ORDERS.na, 1.0, factor)
