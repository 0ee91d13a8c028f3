# SPDX-License-Identifier: MIT
"""One round of the offline procedure: pre-processing, choice of a model, tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.stats

from ehsid.harness.encoding import to_plain
from ehsid.harness.identification import (
    ArxModel,
    IdentificationError,
    IdentificationResult,
    IoData,
    Prediction,
    Preprocessed,
    Preprocessing,
    TooFewSamplesError,
    UnexcitedError,
    fit_percent,
    identify,
    preprocess,
)
from ehsid.harness.identification.choice import orders_added
from ehsid.harness.identification.selection import ROUNDING
from ehsid.harness.studies.problems import Finding, Problem, model_problems

# One-sided level at which one attempt counts as better than another, as for the choice of delay.
LEVEL = 0.99


@dataclass(frozen=True)
class Settings:
    """What one attempt tries."""

    orders: tuple[int, ...]
    delays: tuple[int, ...]
    offset: bool
    preprocessing: Preprocessing

    def __str__(self) -> str:
        return (
            f"orders {_span(self.orders)}, delays {_span(self.delays)}, "
            f"{'with' if self.offset else 'without'} constant term, {self.preprocessing}"
        )


@dataclass(frozen=True, eq=False)
class Attempt:
    """Settings, why they were tried, and what came of them.

    Attributes
    ----------
    settings
        what was tried.
    change, why
        against the best attempt before, in words.
    problems
        what makes the outcome worthless; empty if nothing.
    preprocessed, result
        outcome; None where there is none.
    model
        the chosen model in the units of the record, see `Preprocessed.restore_model`.
    one_step, simulated
        its predictions on the validation part, in the units of the record.
    one_step_fit_percent, simulation_fit_percent
        their fits; NaN where there is no outcome. Between attempts only these compare: those in
        `result` are of the pre-processed signals.
    comparison
        with the best attempt before, in words; empty for the first.
    """

    settings: Settings
    change: str
    why: str
    problems: tuple[Finding, ...]
    preprocessed: Preprocessed | None = None
    result: IdentificationResult | None = None
    model: ArxModel | None = None
    one_step: Prediction | None = None
    simulated: Prediction | None = None
    one_step_fit_percent: float = float("nan")
    simulation_fit_percent: float = float("nan")
    comparison: str = ""

    @property
    def failed_tests(self) -> tuple[str, ...]:
        """Residual tests that fail: "whiteness", "independence"; none where all is rounding."""
        if self.result is None or self.exact:
            return ()
        passed = {
            "whiteness": self.result.whiteness.passed,
            "independence": self.result.independence.passed,
        }
        return tuple(name for name, outcome in passed.items() if not outcome)

    @property
    def exact(self) -> bool:
        """Whether the model predicts to within rounding, which leaves the tests nothing to test."""
        if self.one_step is None:
            return False
        largest = float(np.max(np.abs(self.one_step.measured)))
        return float(np.sqrt(np.mean(self.one_step.residual**2))) <= ROUNDING * largest

    @property
    def sound(self) -> bool:
        """Whether there is a model without problem whose residual passes both tests."""
        return self.result is not None and not self.problems and not self.failed_tests

    def has(self, problem: Problem) -> bool:
        """Whether this problem was found."""
        return any(finding.problem is problem for finding in self.problems)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without samples."""
        return {
            "settings": to_plain(self.settings),
            "change": self.change,
            "why": self.why,
            "comparison": self.comparison,
            "problems": [{"problem": str(f.problem), "text": f.text} for f in self.problems],
            "failed_tests": list(self.failed_tests),
            "one_step_fit_percent": to_plain(self.one_step_fit_percent),
            "simulation_fit_percent": to_plain(self.simulation_fit_percent),
            "model": self.model.to_dict() if self.model is not None else None,
            "preprocessing": self.preprocessed.to_dict() if self.preprocessed is not None else None,
            "result": self.result.to_dict() if self.result is not None else None,
        }


def attempt(data: IoData, settings: Settings, split: float, change: str, why: str) -> Attempt:
    """Carry out one attempt; what the data do not allow becomes a problem, not an exception."""
    try:
        preprocessed = preprocess(data, settings.preprocessing, split=split)
        result = identify(
            preprocessed.data,
            orders=settings.orders,
            delays=settings.delays,
            split=split,
            offset=settings.offset,
        )
    except TooFewSamplesError as error:
        problem = Problem.TOO_SHORT
        text = str(error)
    except UnexcitedError as error:
        problem = Problem.NO_EXCITATION
        text = str(error)
    except IdentificationError as error:
        # With settings that were checked, what is left is an output that rests behind its history.
        problem = Problem.CONSTANT_OUTPUT
        text = str(error)
    else:
        one_step = preprocessed.restore(result.one_step)
        simulated = preprocessed.restore(result.simulated)
        return Attempt(
            settings,
            change,
            why,
            model_problems(result),
            preprocessed,
            result,
            preprocessed.restore_model(result.chosen.model),
            one_step,
            simulated,
            fit_percent(one_step.measured, one_step.predicted),
            fit_percent(simulated.measured, simulated.predicted),
        )
    sentence = text[0].upper() + text[1:] + "."
    return Attempt(settings, change, why, (Finding(problem, sentence),))


def gain(new: Prediction, old: Prediction) -> tuple[float, float]:
    """Mean fall of the squared residual from old to new, and its standard error.

    Paired, on the samples that both have (Diebold and Mariano, "Comparing predictive accuracy", J.
    Bus. Econ. Stat. 13, 1995); the error allows for correlation up to N^(1/3) lags by a Bartlett
    window (Newey and West, Econometrica 55, 1987).
    """
    _, first, second = np.intersect1d(new.index, old.index, return_indices=True)
    with np.errstate(over="ignore", invalid="ignore"):
        fall = old.residual[second] ** 2 - new.residual[first] ** 2
    n = fall.size
    centred = fall - np.mean(fall)
    lags = int(np.ceil(n ** (1.0 / 3.0)))
    variance = float(centred @ centred) / n
    for lag in range(1, lags + 1):
        variance += 2.0 * (1.0 - lag / (lags + 1.0)) * float(centred[lag:] @ centred[:-lag]) / n
    return float(np.mean(fall)), float(np.sqrt(max(variance, 0.0) / n))


def better(new: Attempt, old: Attempt) -> tuple[bool, str]:
    """Is the new attempt to be kept, and why, in words.

    It is where it has fewer problems or fails fewer tests and does not predict worse one step ahead
    on the validation part, beyond chance; or where it predicts better beyond chance and by as much
    as `choose_order` asks for, with no more problems.
    """
    if new.result is None or new.one_step is None or old.result is None or old.one_step is None:
        return False, "no outcome: not kept"
    fall, error = gain(new.one_step, old.one_step)
    quantile = float(scipy.stats.norm.ppf(LEVEL))
    # Residuals that are rounding only are equal.
    floor = (ROUNDING * float(np.max(np.abs(new.one_step.measured)))) ** 2
    clear = abs(fall) > max(quantile * error, floor)
    misfit, before = 100.0 - new.one_step_fit_percent, 100.0 - old.one_step_fit_percent
    # One order's worth at least: the same order on a few other rows is no gain.
    added = max(orders_added(old.result.chosen, new.result.chosen), 1.0)
    needed = 100.0 * (1.0 - (1.0 - old.result.min_improvement) ** added)
    enough = misfit < before * (1.0 - 0.01 * needed)
    fewer = (len(new.problems), len(new.failed_tests)) < (len(old.problems), len(old.failed_tests))
    words = (
        f"one-step misfit {misfit:.3f} % against {before:.3f} %, a difference "
        f"{'beyond' if clear else 'within'} chance"
    )
    if fewer and not (clear and fall < 0.0):
        return True, f"{words}, and fewer tests failed or problems: kept"
    if len(new.problems) > len(old.problems):
        return False, f"{words}, but with more problems: not kept"
    if clear and fall > 0.0:
        if enough:
            return True, f"{words}: kept"
        return False, f"{words}, but below {needed:.1f} % of it: not kept"
    return False, f"{words}: not kept"


def _span(numbers: tuple[int, ...]) -> str:
    if len(numbers) > 2 and numbers == tuple(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(number) for number in numbers)
