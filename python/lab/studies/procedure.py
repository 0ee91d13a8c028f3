# SPDX-License-Identifier: MIT
"""The offline procedure of Ghazali et al. 2011, Fig. 3, which tries again if a test fails."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ehsid.harness.base.encoding import to_plain
from ehsid.harness.models.identification import (
    Agreement,
    EstimatedResponse,
    FrequencyResponse,
    IdentificationError,
    IoData,
    PolesZeros,
    Preprocessing,
    agreement,
    frequency_response,
    poles_zeros,
    power_band,
    response_grid,
)
from ehsid.harness.models.identification.loop import LoopAnalysis, analyse_loop, to_control

from .attempts import MOVES, Attempt, Settings, attempt, better
from .problems import Finding, record_problems


@dataclass(frozen=True, eq=False)
class Procedure:
    """Result of the offline procedure: all attempts, and the best of them."""

    data: IoData
    """The record as given."""
    split: float
    """Share of the record that is the estimation part, 0 to 1."""
    attempts: tuple[Attempt, ...]
    """All attempts in their order; empty if the record allows none."""
    kept: int | None
    """Position of the best attempt in `attempts`; None if there is no model."""
    problems: tuple[Finding, ...]
    """Problems that make the result worthless, of the record or of an attempt: the kept one or,
    without a model, the first one."""
    stopped: str
    """Reason why there was no further attempt, in words."""
    meaning: tuple[str, ...]
    """Sentences on the residual tests, whether they fail and what that means, on a better free run
    of another attempt, and advice; empty if there is no model."""
    poles_zeros: PolesZeros | None = None
    """Poles and zeros of the kept model."""
    response: EstimatedResponse | None = None
    """Frequency response of the kept model with its covariance, in the units of the record;
    frequencies in Hz, or in cycles per sample if the sampling time is not known."""
    input_band: tuple[float, float] | None = None
    """Lowest and highest frequency of the band with 99 % of the input's power: outside it the model
    extrapolates."""
    loop: LoopAnalysis | None = None
    """Analysis of proportional control of the kept model, in the units of the record."""

    @property
    def best(self) -> Attempt:
        """The attempt that was kept.

        Raises
        ------
        IdentificationError
            no attempt was kept; the message contains the problems.
        """
        if self.kept is None:
            raise IdentificationError(" ".join(finding.text for finding in self.problems))
        return self.attempts[self.kept]

    def against(self, truth: FrequencyResponse) -> Agreement:
        """Compares the kept model with a response taken as true, for example that of the rig."""
        model = self.best.model
        if model is None:
            raise IdentificationError("no model was kept")
        return agreement(model, truth, self.data.dt_s or 1.0)

    def to_dict(self) -> dict[str, Any]:
        """Returns the result as plain values for JSON, without the samples."""
        return {
            "split": self.split,
            "dt_s": self.data.dt_s,
            "n_samples": self.data.n_samples,
            "kept": self.kept,
            "problems": [{"problem": str(f.problem), "text": f.text} for f in self.problems],
            "stopped": self.stopped,
            "meaning": list(self.meaning),
            "input_band": None if self.input_band is None else list(self.input_band),
            "loop": to_plain(self.loop),
            "attempts": [made.to_dict() for made in self.attempts],
        }


def run_procedure(
    data: IoData,
    *,
    orders: Iterable[int] = range(2, 6),
    delays: Iterable[int] = range(1, 6),
    preprocessing: Preprocessing | None = None,
    offset: bool = True,
    split: float = 0.5,
) -> Procedure:
    """Pre-processes, identifies and tests; if a test fails, changes one thing and repeats.

    Each change starts from the best attempt so far. The changes come in this order, each once and
    only if it has a purpose: lower orders if a pole and a zero cancel, longer delays, each higher
    order up to 6, linear trends removed, means removed instead of a constant term, a constant term.
    The one-step residuals on the validation part decide which attempt is better, beyond chance
    (`better`). This choice makes the figures of the validation part slightly optimistic, as every
    choice on it does.

    Parameters
    ----------
    data
        input and output.
    orders, delays
        orders and delays, in samples, of the first attempt.
    preprocessing
        pre-processing of the first attempt; `Preprocessing()` by default.
    offset
        whether the first attempt has a constant term.
    split
        share of the samples used for the estimation, 0 < split < 1.

    Raises
    ------
    IdentificationError
        there is no order or delay to try, or a setting is out of range. Faults of the data raise
        no exception, but are listed in `problems`.
    """
    start = Settings(
        tuple(sorted(set(orders))),
        tuple(sorted(set(delays))),
        offset,
        preprocessing or Preprocessing(),
    )
    if not start.orders or not start.delays:
        raise IdentificationError("there is no order or no delay to try")
    if start.orders[0] < 1 or start.delays[0] < 0:
        raise IdentificationError(f"{start}: orders must be at least 1, delays at least 0")
    problems = record_problems(data, split)
    if problems:
        return Procedure(data, split, (), None, problems, "The record allows no attempt.", ())
    attempts = [attempt(data, start, split, "first attempt", "as requested")]
    if attempts[0].result is None:
        why = "The record allows no model."
        return Procedure(data, split, tuple(attempts), None, attempts[0].problems, why, ())

    kept = 0
    for move in MOVES:
        best = attempts[kept]
        if best.sound:
            break
        proposal = move(best, attempts[0])
        if proposal is None or any(proposal[0] == made.settings for made in attempts):
            continue
        settings, change, why = proposal
        new = attempt(data, settings, split, change, why)
        keep, comparison = better(new, best)
        attempts.append(replace(new, comparison=comparison))
        if keep:
            kept = len(attempts) - 1

    best = attempts[kept]
    stopped = (
        "Nothing speaks against the model: there is no need to go on."
        if best.sound
        else "Nothing is left to try: every change of the procedure has been made or has no point."
    )
    model, dt_s = best.model, data.dt_s or 1.0
    assert model is not None
    assert best.result is not None
    grid = response_grid(best.result.n_validation, dt_s)
    return Procedure(
        data,
        split,
        tuple(attempts),
        kept,
        best.problems,
        stopped,
        _meaning(best, attempts),
        poles_zeros(model),
        frequency_response(model, grid, dt_s),
        power_band(data),
        analyse_loop(to_control(model, data.dt_s)),
    )


def _meaning(best: Attempt, attempts: Sequence[Attempt]) -> tuple[str, ...]:
    result = best.result
    assert result is not None
    if best.exact:
        return ("The model predicts to within rounding: there is no residual to test.",)
    sentences = []
    if not best.failed_tests:
        sentences.append("Both residual tests pass: the data speak against nothing in the model.")
    if "independence" in best.failed_tests:
        sentences.append(
            "Order, delay and detrending were varied, and no attempt that could be kept freed the "
            "residual of the input: within these a linear model does not hold, which points to a "
            "nonlinear plant."
        )
    if "whiteness" in best.failed_tests:
        sentences.append(
            "No attempt that could be kept made the residual white: what disturbs the output is "
            "coloured, as sensor noise is in an ARX model, or the plant is nonlinear."
        )
    free = max(attempts, key=_simulation_fit)
    # As in the choice of the order, the misfit must fall by the share required for one order.
    kept = 1.0 - result.min_improvement
    if 100.0 - _simulation_fit(free) < kept * (100.0 - _simulation_fit(best)):
        sentences.append(
            f"Running free, the model of the attempt '{free.change}' fits better, with "
            f"{free.simulation_fit_percent:.2f} % against {best.simulation_fit_percent:.2f} %. The "
            "free run of a plant that integrates hangs on its constant term, which one step ahead "
            "hardly shows: its fit varies much from record to record."
        )
    return (*sentences, *result.advice)


def _simulation_fit(attempt: Attempt) -> float:
    sound = attempt.result is not None and not attempt.problems
    return attempt.simulation_fit_percent if sound else -math.inf
