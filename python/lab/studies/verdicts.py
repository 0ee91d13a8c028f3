# SPDX-License-Identifier: MIT
"""Derives from the maps whether a claim holds, does not hold, or holds only for some conditions.

Compares a start from an offline model with a vague start, on model (16) as the known plant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.firmware.configuration import EstimatorConfiguration, configure_from_record
from ehsid.harness.models.identification import IoData

from . import MODEL_16, KnownPlant
from .claims import ORDERS, SAMPLES, Comparison, Finding, Input, Judged, ResetJudged, excite
from .comparison import Samples, known_records, settling

ALL = slice(None)
B = slice(ORDERS.na, None)
# Added to the seed of a run, so that its offline record is drawn independently of its online one.
OFFLINE_SEEDS = 1_000_000


@dataclass(frozen=True, eq=False)
class Starts:
    """Parameter errors of the seeded and of the vague start on the same records."""

    seeded: FloatArray
    vague: FloatArray
    """Shape (runs, N), relative error |theta_hat - theta| / |theta| after each sample, of the
    scaled parameters that were selected."""

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


# A claim holds if it holds in at least this share of the conditions. It fails if it holds in at
# most one minus this share.
NEARLY = 0.9


class Verdict(StrEnum):
    """Verdict on a claim over a map of conditions."""

    holds = "holds"
    fails = "does not hold"
    partly = "holds only for some"


@dataclass(frozen=True)
class Level:
    """One value of a condition, and the shares of its cells in which a claim holds or fails."""

    value: str
    holds: float
    fails: float


@dataclass(frozen=True)
class ClaimVerdict:
    """Verdict on one claim, with the shares of the map that support it."""

    claim: str
    """The claim in words."""
    verdict: Verdict
    """Verdict over the whole map."""
    holds: float
    fails: float
    equal: float
    """Shares of the map, 0 to 1, where the claim holds, where it fails, and where there is no
    difference; in the rest the runs decide nothing or no contender settles."""
    levels: dict[str, tuple[Level, ...]]
    """Shares for each value of a condition, by name of the condition."""

    def where(self) -> str:
        """Lists the values of each condition at which the claim nearly always or never holds."""
        parts = []
        for name, levels in self.levels.items():
            good = [level.value for level in levels if level.holds >= NEARLY]
            bad = [level.value for level in levels if level.holds <= 1.0 - NEARLY]
            if good and len(good) < len(levels):
                parts.append(f"holds for {name} {', '.join(good)}")
            if bad and len(bad) < len(levels):
                parts.append(f"does not for {name} {', '.join(bad)}")
        return "; ".join(parts) or "no single condition decides"


def _share(findings: Sequence[Finding], wanted: Finding) -> float:
    return sum(finding is wanted for finding in findings) / len(findings)


def _verdict(claim: str, cells: Sequence[tuple[dict[str, str], Comparison]]) -> ClaimVerdict:
    findings = [comparison.finding for _, comparison in cells]
    holds = _share(findings, Finding.holds)
    verdict = Verdict.partly
    if holds >= NEARLY:
        verdict = Verdict.holds
    elif holds <= 1.0 - NEARLY:
        verdict = Verdict.fails
    levels = {}
    for name in cells[0][0]:
        values = dict.fromkeys(condition[name] for condition, _ in cells)
        levels[name] = tuple(
            Level(
                value,
                *(
                    _share([c.finding for at, c in cells if at[name] == value], wanted)
                    for wanted in (Finding.holds, Finding.fails)
                ),
            )
            for value in values
        )
    return ClaimVerdict(
        claim,
        verdict,
        holds,
        _share(findings, Finding.fails),
        _share(findings, Finding.equal),
        levels,
    )


def _condition(judged: Judged) -> dict[str, str]:
    at = judged.condition
    return {
        "P0": f"{at.p0:g}",
        "noise": f"{at.noise:.3g}",
        "input": at.input.value,
        "lambda0": f"{at.lambda0:g}",
    }


CLAIMS: dict[str, Callable[[Judged], Comparison]] = {
    "The varying factor converges faster than lambda = 1": lambda judged: judged.faster,
    "The varying factor is calmer than lambda = 0.99 once converged": lambda judged: judged.calmer,
    "The varying factor has the lowest RMSE of the three": lambda judged: judged.lower_rmse,
}
RESET_CLAIM = "After a change the reset brings the estimate back sooner"


def verdicts(judged: Sequence[Judged], resets: Sequence[ResetJudged]) -> list[ClaimVerdict]:
    """Returns one verdict for each claim of the paper on the varying forgetting factor."""
    first_claims = [
        _verdict(claim, [(_condition(cell), of(cell)) for cell in judged])
        for claim, of in CLAIMS.items()
    ]
    reset_cells = [
        ({"noise": f"{cell.noise:.3g}", "factor": f"{cell.factor:g}"}, cell.sooner)
        for cell in resets
    ]
    return [*first_claims, _verdict(RESET_CLAIM, reset_cells)]
