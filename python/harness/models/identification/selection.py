# SPDX-License-Identifier: MIT
"""Chooses order and delay on validation data, with reasons and residual tests.

The orders and delays that a search tries, as users write them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from ...base.encoding import to_plain
from .candidates import Candidate, Rejected, judge
from .data import (
    ROUNDING,
    ArxOrders,
    IdentificationError,
    IoData,
    TooFewSamplesError,
    UnexcitedError,
)
from .dynamics import dynamics
from .order_rules import advise, choose_delay, choose_order, delay_reason, order_reason
from .residuals import (
    MAX_LAG,
    IndependenceTest,
    Prediction,
    WhitenessTest,
    independence_test,
    predict_one_step,
    simulate,
    whiteness_test,
)

DEFAULT_ORDERS = range(2, 6)
DEFAULT_DELAYS = range(1, 6)
MIN_IMPROVEMENT = 0.05
MIN_ROWS = 20  # a fit over fewer equations has no significance


@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """Result of `identify`."""

    chosen: Candidate
    """Candidate with the chosen order and delay, and its model."""
    reason: str
    """Reason for the chosen order, in words with numbers."""
    delay_reason: str
    """Reason for the chosen delay."""
    by_order: tuple[Candidate, ...]
    """One candidate for each order, with the delay chosen for it, by number of parameters."""
    candidates: tuple[Candidate, ...]
    """All candidates the data determine, by number of parameters, then na, then delay."""
    rejected: tuple[Rejected, ...]
    """Structures that the data do not determine."""
    one_step: Prediction
    simulated: Prediction
    """One-step prediction and free run of the chosen model on the validation part."""
    whiteness: WhitenessTest
    independence: IndependenceTest
    """Tests of the one-step residuals on the validation part."""
    advice: tuple[str, ...]
    """Cautions and suggested next steps; empty if there are none."""
    dt_s: float | None
    """Sampling time in seconds; None if it is not known."""
    n_estimation: int
    n_validation: int
    """Number of samples in the two parts."""
    min_improvement: float
    """Share of the misfit that each added order must remove."""

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON, without the predictions: they are data, not results."""
        plain: dict[str, Any] = to_plain(self)
        del plain["one_step"], plain["simulated"]
        plain["chosen"]["model"] = self.chosen.model.to_dict()
        plain["dynamics"] = to_plain(dynamics(self.chosen.model, self.dt_s))
        return plain


def identify(
    data: IoData,
    *,
    orders: Iterable[int | tuple[int, int]] = DEFAULT_ORDERS,
    delays: Iterable[int] = DEFAULT_DELAYS,
    split: float = 0.5,
    offset: bool = True,
    remove_means: bool = False,
    min_improvement: float = MIN_IMPROVEMENT,
    max_lag: int = MAX_LAG,
) -> IdentificationResult:
    """Estimates ARX models of several orders and delays, chooses one, and tests its residuals.

    All models are estimated on the first part of the data and judged on the rest, all on the same
    samples. `choose_delay` and `choose_order` give the rules of the choice.

    Parameters
    ----------
    data
        input and output.
    orders
        orders to try: na = nb, or pairs (na, nb).
    delays
        delays nk to try, in samples.
    split
        share of the samples used for the estimation, 0 < split < 1.
    offset
        whether a constant term is estimated. It represents the working point and a null bias of
        the valve exactly, also for an integrating plant.
    remove_means
        whether the means of the estimation part are subtracted from both parts. For an integrating
        plant this is wrong: its output drifts with B(1) times the mean of the input.
    min_improvement
        share of the misfit that each added order must remove.
    max_lag
        largest lag of the residual tests in samples; it is limited to a quarter of the number of
        validation residuals.

    Raises
    ------
    IdentificationError
        there is nothing to try, a setting is out of range, or the output is constant in a part.
    TooFewSamplesError
        a part is too short.
    UnexcitedError
        the data determine none of the structures.
    """
    if not 0.0 <= min_improvement < 1.0:
        raise IdentificationError(f"min_improvement must be in [0, 1), not {min_improvement:g}")
    structures = _structures(orders, delays, offset)
    delays_tried = sorted({structure.nk for structure in structures})
    skip = max(structure.n_history for structure in structures)
    estimation, validation = data.split(split)
    n_needed = max(structure.n_parameters for structure in structures) + 1
    _check_part(estimation, "estimation", skip, n_needed)
    _check_part(validation, "validation", skip, n_needed)

    judged, rejected = [], []
    for structure in structures:
        outcome = judge(structure, estimation, validation, remove_means=remove_means, skip=skip)
        if isinstance(outcome, Rejected):
            rejected.append(outcome)
        else:
            judged.append(outcome)
    if not judged:
        raise UnexcitedError(rejected[0].parameters, rejected[0].why)

    loss_floor = (ROUNDING * float(np.max(np.abs(data.y)))) ** 2
    by_order = tuple(
        choose_delay(list(group), loss_floor)
        for _, group in groupby(judged, key=lambda pair: (pair[0].orders.na, pair[0].orders.nb))
    )
    chosen = choose_order(by_order, min_improvement, 100.0 * ROUNDING)
    same_order = [
        candidate
        for candidate, _ in judged
        if (candidate.orders.na, candidate.orders.nb) == (chosen.orders.na, chosen.orders.nb)
    ]
    one_step = predict_one_step(chosen.model, validation, skip=skip)
    lag = min(max_lag, one_step.residual.size // 4)
    white = whiteness_test(one_step.residual, runs=one_step.runs, max_lag=lag)
    independent = independence_test(
        one_step.residual, data.u[one_step.index], runs=one_step.runs, max_lag=lag
    )
    return IdentificationResult(
        chosen=chosen,
        reason=order_reason(by_order, chosen, min_improvement),
        delay_reason=delay_reason(same_order, chosen),
        by_order=by_order,
        candidates=tuple(candidate for candidate, _ in judged),
        rejected=tuple(rejected),
        one_step=one_step,
        simulated=simulate(chosen.model, validation, skip=skip),
        whiteness=white,
        independence=independent,
        advice=advise(
            by_order,
            chosen,
            delays_tried,
            white,
            independent,
            min_improvement,
            validation.n_samples,
            data.dt_s,
        ),
        dt_s=data.dt_s,
        n_estimation=estimation.n_samples,
        n_validation=validation.n_samples,
        min_improvement=min_improvement,
    )


def _structures(
    orders: Iterable[int | tuple[int, int]], delays: Iterable[int], offset: bool
) -> list[ArxOrders]:
    pairs = {(order, order) if isinstance(order, int) else order for order in orders}
    structures = [ArxOrders(na, nb, nk, offset) for na, nb in pairs for nk in set(delays)]
    if not structures:
        raise IdentificationError("there is no order or no delay to try")
    return sorted(structures, key=lambda s: (s.n_parameters, s.na, s.nk))


def _check_part(part: IoData, name: str, skip: int, n_needed: int) -> None:
    """Checks that the part is long enough and that its output is not constant."""
    rows = [part.y[s.start + skip : s.stop] for s in part.segments if s.stop - s.start > skip]
    n_rows = sum(row.size for row in rows)
    n_needed = max(n_needed, MIN_ROWS)
    if n_rows < n_needed:
        raise TooFewSamplesError(
            f"the {name} part has {part.n_samples} samples in {len(part.segments)} "
            f"segment{'s' * (len(part.segments) > 1)}, "
            f"which leave {n_rows} equations after the {skip} samples of history of each; "
            f"expected at least {n_needed}; record longer, or try lower orders and delays"
        )
    if np.ptp(np.concatenate(rows)) == 0.0:
        raise IdentificationError(
            f"the output '{part.output_name}' is constant in the {name} part: expected a response "
            "to the input; record the plant in motion, or name another --output"
        )


# Beyond these a search over orders and delays takes hours, and its models have no meaning.
MOST_ORDER, MOST_DELAY = 50, 1000


def parse_range(text: str, option: str, most: int) -> range:
    """Returns the range that a text such as "2-5" or "3" names, upper end included.

    Raises
    ------
    ValueError
        the text is no range of whole numbers from 0 to `most`.
    """
    match = re.fullmatch(r"([0-9]{1,9})(?:-([0-9]{1,9}))?", text.strip())
    low, high = (int(match[1]), int(match[2] or match[1])) if match else (0, -1)
    if not low <= high <= most:
        raise ValueError(
            f"{option} {text!r}: expected a number or a range such as 2-5, at most {most}"
        )
    return range(low, high + 1)
