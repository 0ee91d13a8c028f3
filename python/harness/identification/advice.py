# SPDX-License-Identifier: MIT
"""Advice on a chosen model: cautions, and what to try next."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.identification.candidates import Candidate
from ehsid.harness.identification.choice import orders_added
from ehsid.harness.identification.residuals import IndependenceTest, WhitenessTest


def advise(
    by_order: Sequence[Candidate],
    chosen: Candidate,
    delays_tried: Sequence[int],
    whiteness: WhitenessTest,
    independence: IndependenceTest,
    min_improvement: float,
) -> tuple[str, ...]:
    """Returns the advice as sentences, most important first; empty if there is no advice."""
    advice: list[str] = []
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
    if 100.0 - best.simulation_fit_percent < kept * (100.0 - simulation):
        advice.append(
            f"Another order simulates better: {best.orders} with a simulation fit of "
            f"{best.simulation_fit_percent:.2f} % against {simulation:.2f} %; prefer it where the "
            "model is to run without measurements."
        )
    if not independence.passed:
        advice.append(
            "The residual still contains the input: dynamics are missing or not linear. "
            "Try a higher order or another delay, and look for nonlinear effects."
        )
    if not whiteness.passed:
        advice.append(
            "The residual is not white: the intervals of the parameters are not reliable, and the "
            "estimates are biased where it is the noise that is coloured."
        )
    if independence.feedback:
        advice.append(
            "The input follows the residual, as in a closed loop: delay 0 and the independence "
            "test are not to be trusted there."
        )
    if chosen is by_order[-1] and len(by_order) > 1:
        advice.append("The highest order tried was chosen: try higher ones.")
    if len(delays_tried) > 1 and chosen.orders.nk == max(delays_tried):
        advice.append("The longest delay tried was chosen: try longer ones.")
    return tuple(advice)
