# SPDX-License-Identifier: MIT
"""The offline procedure of Ghazali et al. 2011, Fig. 3, with its loop back where a test fails."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ehsid.harness.encoding import to_plain
from ehsid.harness.identification import (
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
from ehsid.harness.identification.loop import LoopAnalysis, analyse_loop
from ehsid.harness.identification.systems import to_control
from ehsid.harness.studies.attempts import Attempt, Settings, attempt, better
from ehsid.harness.studies.moves import MOVES
from ehsid.harness.studies.problems import Finding, record_problems


@dataclass(frozen=True, eq=False)
class Procedure:
    """All attempts, and the best of them.

    Attributes
    ----------
    data
        the record as given.
    split
        share of it that is the estimation part.
    attempts
        in the order they were made; empty where the record allows none.
    kept
        the best: position in `attempts`, None where there is no model.
    problems
        what makes the outcome worthless: of the record, or of the attempt that was kept.
    stopped
        why there was no further attempt, in words.
    meaning
        which tests still fail and what that means; one sentence if none does.
    poles_zeros
        of the kept model.
    response
        of the kept model with its band, in the units of the record; frequencies in Hz, or in
        cycles a sample where the sampling time is not known.
    input_band
        lowest and highest frequency of the band with 99 % of the input's power: beyond it the
        model extrapolates.
    loop
        proportional control of the kept model, in the units of the record.
    """

    data: IoData
    split: float
    attempts: tuple[Attempt, ...]
    kept: int | None
    problems: tuple[Finding, ...]
    stopped: str
    meaning: tuple[str, ...]
    poles_zeros: PolesZeros | None = None
    response: EstimatedResponse | None = None
    input_band: tuple[float, float] | None = None
    loop: LoopAnalysis | None = None

    @property
    def best(self) -> Attempt:
        """The attempt that was kept.

        Raises
        ------
        IdentificationError
            there is none; the message has the problems.
        """
        if self.kept is None:
            raise IdentificationError(" ".join(finding.text for finding in self.problems))
        return self.attempts[self.kept]

    def against(self, truth: FrequencyResponse) -> Agreement:
        """The kept model beside a response taken for true, as that of the rig."""
        model = self.best.model
        if model is None:
            raise IdentificationError("no model was kept")
        return agreement(model, truth, self.data.dt_s or 1.0)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without samples."""
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
            "attempts": [one.to_dict() for one in self.attempts],
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
    """Pre-process, identify, test; where a test fails, change one thing and try again.

    Changes are made to the best attempt so far, in this order, each once and only where it has a
    point: lower orders where pole and zero cancel, longer delays, each higher order up to 6, lines
    removed, means removed instead of a constant term. The best is judged by the one-step residuals
    on the validation part, beyond chance (`better`). The choice among the few attempts makes the
    figures of the validation part a little too good, as every choice on it does.

    Parameters
    ----------
    data
        input and output.
    orders, delays
        of the first attempt.
    preprocessing
        of the first attempt; `Preprocessing()` by default.
    offset
        whether the first attempt has a constant term.
    split
        share of the samples used for the estimation, 0 < split < 1.

    Raises
    ------
    IdentificationError
        no order or delay to try, or a setting out of range. What is wrong with the data is never
        raised, but stands in `problems`.
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
    found = record_problems(data, split)
    if found:
        return Procedure(data, split, (), None, found, "The record allows no attempt.", ())
    attempts = [attempt(data, start, split, "first attempt", "as asked for")]
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
    # As for the choice of an order: a difference counts from one order's worth of misfit on.
    kept = 1.0 - result.min_improvement
    if 100.0 - _simulation_fit(free) < kept * (100.0 - _simulation_fit(best)):
        sentences.append(
            f"Running free, the model of the attempt '{free.change}' fits better, with "
            f"{free.simulation_fit_percent:.2f} % against {best.simulation_fit_percent:.2f} %. The "
            "free run of a plant that integrates hangs on its constant term, which one step ahead "
            "hardly shows: its fit varies much from record to record."
        )
    return (*sentences, *result.advice)


def _simulation_fit(one: Attempt) -> float:
    sound = one.result is not None and not one.problems
    return one.simulation_fit_percent if sound else -math.inf
