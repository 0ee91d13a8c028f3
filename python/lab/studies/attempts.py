# SPDX-License-Identifier: MIT
"""One attempt of the offline procedure: pre-processing, choice of a model, residual tests.

Changes of the settings that the offline procedure tries if a test fails, in their order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.stats

from ehsid.harness.base.encoding import to_plain
from ehsid.harness.models.identification import (
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
from ehsid.harness.models.identification.data import ROUNDING
from ehsid.harness.models.identification.order_rules import orders_added

from .problems import Finding, Problem, model_problems

# One-sided confidence level at which one attempt counts as better than another. The choice of the
# delay uses the same level.
LEVEL = 0.99


@dataclass(frozen=True)
class Settings:
    """Orders, delays, constant term and pre-processing that one attempt tries."""

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
    """Settings of one attempt, the reason for them, and the result."""

    settings: Settings
    """Orders, delays, constant term and pre-processing that were tried."""
    change: str
    why: str
    """What differs from the best earlier attempt, and the reason, in words."""
    problems: tuple[Finding, ...]
    """Problems that make the result worthless; empty if there are none."""
    preprocessed: Preprocessed | None = None
    result: IdentificationResult | None = None
    """Pre-processed signals and result of the identification; None if the attempt gave none."""
    model: ArxModel | None = None
    """The chosen model in the units of the record, see `Preprocessed.restore_model`."""
    one_step: Prediction | None = None
    simulated: Prediction | None = None
    """Predictions of the model on the validation part, in the units of the record."""
    one_step_fit_percent: float = float("nan")
    simulation_fit_percent: float = float("nan")
    """Fits of these predictions in percent; NaN if the attempt gave no result. Only these fits can
    be compared between attempts: the fits in `result` are of the pre-processed signals."""
    comparison: str = ""
    """Comparison with the best earlier attempt, in words; empty for the first attempt."""

    @property
    def failed_tests(self) -> tuple[str, ...]:
        """Names of the failed residual tests, "whiteness" and "independence"; none if `exact`."""
        if self.result is None or self.exact:
            return ()
        passed = {
            "whiteness": self.result.whiteness.passed,
            "independence": self.result.independence.passed,
        }
        return tuple(name for name, outcome in passed.items() if not outcome)

    @property
    def exact(self) -> bool:
        """Whether the residual is only rounding error, so that the residual tests do not apply."""
        if self.one_step is None:
            return False
        largest = float(np.max(np.abs(self.one_step.measured)))
        return float(np.sqrt(np.mean(self.one_step.residual**2))) <= ROUNDING * largest

    @property
    def sound(self) -> bool:
        """Whether the attempt gave a model without problems whose residual passes both tests."""
        return self.result is not None and not self.problems and not self.failed_tests

    def has(self, problem: Problem) -> bool:
        """Returns whether the attempt has this problem."""
        return any(finding.problem is problem for finding in self.problems)

    def to_dict(self) -> dict[str, Any]:
        """Returns the attempt as plain values for JSON, without the samples."""
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
    """Carries out one attempt; data that allow no model give a problem, not an exception."""
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
        # The settings were checked before. The only cause left is an output that is constant in
        # the rows that can be predicted.
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
    """Returns the mean decrease of the squared residual from old to new, and its standard error.

    The comparison is paired, on the samples that both predictions have (Diebold and Mariano,
    "Comparing predictive accuracy", J. Bus. Econ. Stat. 13, 1995). The standard error allows for
    correlation up to N^(1/3) lags by a Bartlett window (Newey and West, Econometrica 55, 1987).
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
    """Returns whether to keep the new attempt instead of the old one, and the reason in words.

    All predictions are one step ahead on the validation part. The new attempt is kept in two cases:
    it has fewer problems, or as many problems and fewer failed tests, and it does not predict worse
    beyond chance; or it has no more problems and predicts better beyond chance, by at least the
    improvement that `choose_order` requires.
    """
    if new.result is None or new.one_step is None or old.result is None or old.one_step is None:
        return False, "no outcome: not kept"
    fall, error = gain(new.one_step, old.one_step)
    quantile = float(scipy.stats.norm.ppf(LEVEL))
    # A difference below this floor is only rounding error.
    floor = (ROUNDING * float(np.max(np.abs(new.one_step.measured)))) ** 2
    clear = abs(fall) > max(quantile * error, floor)
    misfit, before = 100.0 - new.one_step_fit_percent, 100.0 - old.one_step_fit_percent
    # The improvement of at least one order is required, because the same order fitted to slightly
    # different rows is no gain.
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


HIGHEST_ORDER = 6
MORE_DELAYS = 5

Proposal = tuple[Settings, str, str]
"""New settings, what they change, and the reason, both in words."""

Move = Callable[[Attempt, Attempt], Proposal | None]
"""Makes a proposal from the best attempt so far and the first one; None if it has no purpose."""


def _lower_orders(best: Attempt, first: Attempt) -> Proposal | None:
    assert best.result is not None
    lower = tuple(range(1, best.result.chosen.orders.na))
    if not best.has(Problem.NON_MINIMAL) or not lower:
        return None
    why = f"at order {lower[-1] + 1} a pole and a zero cancel within their uncertainty"
    return replace(best.settings, orders=lower), "lower orders", why


def _longer_delays(best: Attempt, first: Attempt) -> Proposal | None:
    assert best.result is not None
    delays = best.settings.delays
    longest = best.result.chosen.orders.nk == delays[-1] and len(delays) > 1
    if "independence" not in best.failed_tests and not longest:
        return None
    more = tuple(sorted({*delays, *range(delays[-1] + 1, delays[-1] + MORE_DELAYS + 1)}))
    why = (
        "the longest delay tried was chosen"
        if longest
        else "the residual still contains the input: a delay may be missing"
    )
    return replace(best.settings, delays=more), f"delays up to {more[-1]}", why


def _order(order: int) -> Move:
    def move(best: Attempt, first: Attempt) -> Proposal | None:
        assert best.result is not None
        if not best.failed_tests or order <= best.result.chosen.orders.na:
            return None
        why = f"{' and '.join(best.failed_tests)} of the residual failed: dynamics may be missing"
        return replace(best.settings, orders=(order,)), f"order {order}", why

    return move


def _lines_removed(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests:
        return None
    changed = replace(best.settings.preprocessing, trend="linear")
    settings = replace(best.settings, orders=_all_orders(best, first), preprocessing=changed)
    why = f"{' and '.join(best.failed_tests)} of the residual failed: a drift may be the cause"
    return settings, "lines removed", why


def _means_removed(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests or not best.settings.offset:
        return None
    changed = replace(best.settings.preprocessing, trend="mean")
    orders = _all_orders(best, first)
    settings = replace(best.settings, orders=orders, preprocessing=changed, offset=False)
    why = "the working point taken out as the paper does it, by means"
    return settings, "means removed, no constant term", why


def _constant_term(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests or best.settings.offset:
        return None
    why = "the working point may lie elsewhere than at the means"
    orders = _all_orders(best, first)
    return replace(best.settings, orders=orders, offset=True), "constant term", why


def _all_orders(best: Attempt, first: Attempt) -> tuple[int, ...]:
    """Returns all orders tried first or best, since changed signals may need another order."""
    return tuple(sorted({*first.settings.orders, *best.settings.orders}))


MOVES: tuple[Move, ...] = (
    _lower_orders,
    _longer_delays,
    *(_order(order) for order in range(2, HIGHEST_ORDER + 1)),
    _lines_removed,
    _means_removed,
    _constant_term,
)
