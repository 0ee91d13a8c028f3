# SPDX-License-Identifier: MIT
"""Rules for the choice of delay and order, the reasons in words, and advice on the model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.stats

from ...base.numbers import FloatArray
from .candidates import Candidate, diverges, simulation_words
from .residuals import IndependenceTest, WhitenessTest

# One-sided confidence level at which one delay counts as worse than another.
DELAY_LEVEL = 0.99
# Judged on fewer samples, or on a shorter time, a record is called short. So many samples are as
# many as the recursive estimator needs before it converges, and a servo reverses in about a second.
FEW_SAMPLES, FEW_SECONDS = 300, 1.0
# Delays proposed beyond the lag at which the residual depends most on the input.
DELAYS_AROUND = 3


def orders_added(lower: Candidate, higher: Candidate) -> float:
    """Returns the difference in order of two candidates; two parameters count as one order."""
    return (higher.orders.n_parameters - lower.orders.n_parameters) / 2.0


def choose_delay(judged: Sequence[tuple[Candidate, FloatArray]], floor: float) -> Candidate:
    """Returns the candidate with the smallest delay that is not clearly worse than the best one.

    The best candidate has the lowest validation loss. Another candidate is clearly worse if the
    mean of the paired differences of squared residuals exceeds the 99 % normal quantile times its
    standard error. A delay chosen too short costs one small coefficient; the other coefficients
    cannot compensate for a delay chosen too long.

    Parameters
    ----------
    judged
        candidates of one order with their one-step validation residuals, by increasing delay.
    floor
        losses and differences of losses below this value are rounding errors and count as equal,
        in squared units of the output.
    """
    best = min(judged, key=lambda pair: max(pair[0].validation.loss, floor))
    quantile = float(scipy.stats.norm.ppf(DELAY_LEVEL))

    def clearly_worse(residual: FloatArray) -> bool:
        difference = residual**2 - best[1] ** 2
        error = float(np.std(difference) / np.sqrt(difference.size))
        return float(np.mean(difference)) > max(quantile * error, floor)

    # The best candidate is never worse than itself, so the search always finds one.
    return next(candidate for candidate, residual in judged if not clearly_worse(residual))


def choose_order(by_order: Sequence[Candidate], min_improvement: float, floor: float) -> Candidate:
    """Returns the lowest order above which the validation fit does not improve meaningfully.

    This is the first candidate whose one-step misfit (100 - fit in percent) no later candidate
    lowers by the share `min_improvement` for each added order; two parameters count as one order.
    The misfit is compared instead of the fit: with fast sampling every order fits above 99 %, but
    the error of one order may be half that of another. The improvement is required for each added
    order, so that a much higher order does not win by many small gains.

    Parameters
    ----------
    by_order
        one candidate for each order, by increasing number of parameters.
    min_improvement
        required relative reduction of the misfit per added order, 0 <= min_improvement < 1.
    floor
        misfits below this value are rounding errors and count as equal, in percent.
    """
    for position, candidate in enumerate(by_order):
        misfit = max(_misfit(candidate), floor)
        if not any(
            max(_misfit(other), floor)
            < misfit * (1.0 - min_improvement) ** orders_added(candidate, other)
            for other in by_order[position + 1 :]
        ):
            return candidate
    return by_order[-1]


def order_reason(by_order: Sequence[Candidate], chosen: Candidate, min_improvement: float) -> str:
    """Returns the reason for the chosen order, with the numbers."""
    position = list(by_order).index(chosen)
    text = (
        f"{_label(chosen).capitalize()}, chosen by the prediction of one step: one-step fit "
        f"{_fit(chosen)} on the validation data, "
        f"{simulation_words(chosen.simulation_fit_percent)}."
    )
    if position > 0:
        below = max(by_order[:position], key=lambda other: other.one_step_fit_percent)
        text += (
            f" {_label(below).capitalize()} reaches {_fit(below)}: "
            f"the step up lowers the misfit by {_gain(below, chosen)}."
        )
    if position + 1 < len(by_order):
        above = max(by_order[position + 1 :], key=lambda other: other.one_step_fit_percent)
        change = (
            f"lowers the misfit by only {_gain(chosen, above)}"
            if above.one_step_fit_percent > chosen.one_step_fit_percent
            else "does not lower the misfit"
        )
        added = orders_added(chosen, above)
        needed = 100.0 * (1.0 - (1.0 - min_improvement) ** added)
        text += (
            f" The best of the higher orders, {_label(above)} with {_fit(above)}, {change}; "
            f"to count, {added:g} more {'order' if added == 1 else 'orders'} must lower it by "
            f"{needed:.1f} % ({100.0 * min_improvement:g} % for each order added)."
        )
    elif position > 0:
        text += " It is the highest order tried, so that the fit may still improve beyond it."
    else:
        text += " It is the only order tried that the data determine."
    return text


def delay_reason(same_order: Sequence[Candidate], chosen: Candidate) -> str:
    """Returns the reason for the chosen delay, with the numbers.

    `same_order` holds the candidates of the chosen order with all delays.
    """
    nk = chosen.orders.nk
    if len(same_order) == 1:
        return f"Delay {nk}: the only one tried that the data determine."
    best = max(same_order, key=lambda other: other.one_step_fit_percent)
    others = [other for other in same_order if other is not chosen]
    rival = max(others, key=lambda other: other.one_step_fit_percent)
    worst = min(others, key=lambda other: other.one_step_fit_percent)
    if best is not chosen and best.one_step_fit_percent > chosen.one_step_fit_percent:
        return (
            f"Delay {nk} with {_fit(chosen)}: the smallest that is not clearly worse than "
            f"the best, delay {best.orders.nk} with {_fit(best)}; the data hardly tell them apart "
            f"(all delays tried fit between {worst.one_step_fit_percent:.2f} "
            f"and {_fit(best)})."
        )
    return (
        f"Delay {nk} with {_fit(chosen)}: the best one-step fit at this order; "
        f"next is delay {rival.orders.nk} with {_fit(rival)}."
    )


def advise(
    by_order: Sequence[Candidate],
    chosen: Candidate,
    delays_tried: Sequence[int],
    whiteness: WhitenessTest,
    independence: IndependenceTest,
    min_improvement: float,
    n_judged: int,
    dt_s: float | None,
) -> tuple[str, ...]:
    """Returns the advice as sentences, most important first; empty if there is no advice.

    n_judged, dt_s: number of samples on which the candidates were judged, and their sampling time.
    """
    advice: list[str] = []
    seconds = math.inf if dt_s is None else n_judged * dt_s
    if n_judged < FEW_SAMPLES or seconds < FEW_SECONDS:
        length = f"{n_judged} samples" + ("" if dt_s is None else f" ({seconds:.3g} s)")
        advice.append(
            f"The record is short: the models are judged on {length} only, so that order and delay "
            "are uncertain, and slow motion does not show. Record for ten seconds or longer, with "
            "motion in both directions."
        )
    simulation = chosen.simulation_fit_percent
    if simulation < 0.0:
        advice.append(
            "Running free, the model is worse than the mean of the output: it predicts one step "
            "ahead, but does not simulate."
        )
    best = max(by_order, key=lambda candidate: candidate.simulation_fit_percent)
    # The required improvement is the same as in the choice of the order, but always that of at
    # least one added order, also where the other candidate has a lower order.
    kept = (1.0 - min_improvement) ** max(orders_added(chosen, best), 1.0)
    # A model that is worse than the mean of the output is no advice.
    if 0.0 < best.simulation_fit_percent > 100.0 - kept * (100.0 - simulation):
        here = "a simulation that diverges" if diverges(simulation) else f"{simulation:.2f} %"
        advice.append(
            f"Another order simulates better: {best.orders} with a simulation fit of "
            f"{best.simulation_fit_percent:.2f} % against {here}; prefer it where the model is to "
            "run without measurements."
        )
    # Where the residual points to an input longer ago than was tried, this comes first, and nothing
    # else can be concluded from it.
    causal = independence.lags >= 0
    lag = int(independence.lags[causal][np.argmax(np.abs(independence.correlation[causal]))])
    reached = max(*delays_tried, chosen.orders.nk + chosen.orders.nb - 1)
    points_beyond = not independence.passed and lag > reached
    if points_beyond:
        longest = lag + DELAYS_AROUND
        advice.append(
            "The residual still contains the input, most of all that of "
            f"{lag} samples ago, and the longest delay tried is {max(delays_tried)}: try delays up "
            f"to {longest} (--delays {min(delays_tried)}-{longest})"
            + (" or a higher order." if chosen is by_order[-1] else ".")
        )
    elif not independence.passed:
        advice.append(_missing_advice(by_order, chosen, delays_tried))
    if not whiteness.passed:
        advice.append(
            "The residual is not white: the intervals of the parameters are not reliable, and the "
            "estimates are biased where it is the noise that is coloured."
        )
    if independence.feedback:
        advice.append(
            "The residual is correlated with later inputs, which has two possible reasons. Either "
            "the input reacts to the output, as in a closed loop: then do not trust a model with "
            "delay 0, nor the test of independence. Or later inputs resemble earlier ones, as in a "
            "periodic or slow command, and the model lacks a part of what these did"
            + (
                "."
                if points_beyond
                else ", such as an effect that is not linear: `ehsid gap` looks for such effects "
                "of a servo."
            )
        )
    # Where the residual contains the input, the sentence on that has proposed these already.
    if independence.passed and chosen is by_order[-1] and len(by_order) > 1:
        advice.append("The highest order tried was chosen: try higher ones.")
    if independence.passed and len(delays_tried) > 1 and chosen.orders.nk == max(delays_tried):
        advice.append("The longest delay tried was chosen: try longer ones.")
    return tuple(advice)


def _missing_advice(
    by_order: Sequence[Candidate], chosen: Candidate, delays_tried: Sequence[int]
) -> str:
    """Says what may be missing where the residual contains the input, without what was tried."""
    untried = []
    if chosen is by_order[-1]:
        untried.append("a higher order")
    if chosen.orders.nk == max(delays_tried):
        untried.append("a longer delay")
    text = "The residual still contains the input: the model lacks a part of what the input does. "
    if untried:
        text += f"Try {' or '.join(untried)}. If this does not help, "
    else:
        text += "Higher orders and longer delays were tried and do not help enough, so that "
    return text + (
        "an effect that is not linear is probable, such as friction or a dead band: `ehsid gap` "
        "looks for such effects of a servo."
    )


def _misfit(candidate: Candidate) -> float:
    return 100.0 - candidate.one_step_fit_percent


def _gain(lower: Candidate, higher: Candidate) -> str:
    before = _misfit(lower)
    gain = 100.0 * (1.0 - _misfit(higher) / before) if before > 0.0 else 0.0
    return f"{gain:.1f} %"


def _fit(candidate: Candidate) -> str:
    return f"{candidate.one_step_fit_percent:.2f} %"


def _label(candidate: Candidate) -> str:
    na, nb = candidate.orders.na, candidate.orders.nb
    return f"order {na}" if na == nb else f"order na = {na}, nb = {nb}"
