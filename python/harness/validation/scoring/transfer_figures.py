# SPDX-License-Identifier: MIT
"""Comparison of the shrinkage predicted on held-out data with that on the transfer record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.gap.schema import Estimate
from ehsid.harness.validation.scoring.figures import Figure, quantile, share
from ehsid.harness.validation.scoring.judged_case import Scored


@dataclass(frozen=True)
class Promise:
    """Shrinkage of one case as predicted and as realised, each with its interval."""

    case: str
    right: bool
    predicted: Estimate
    realised: Estimate


@dataclass(frozen=True)
class Promises:
    """Predicted and realised values of one measure of shrinkage.

    Attributes
    ----------
    words
        name of the measure.
    each
        promises of the cases in which an effect was named.
    figures
        shares of the cases whose realised value lies in the predicted interval, whose two intervals
        overlap, and whose realised value is at least the lower end of the predicted interval; then
        medians of the realised less the predicted value, of right cases and of the others.
    """

    words: str
    each: tuple[Promise, ...]
    figures: tuple[Figure, ...]


def promises(cases: Sequence[Scored]) -> tuple[Promises, ...]:
    """Returns the promises of both measures of shrinkage."""
    explainable, nominal = [], []
    for case in cases:
        if case.transfer is None or not case.said.named:
            continue
        right = case.judged.right
        if case.said.of_explainable is not None and case.transfer.of_explainable is not None:
            explainable.append(
                Promise(case.name, right, case.said.of_explainable, case.transfer.of_explainable)
            )
        if case.said.from_nominal is not None:
            nominal.append(
                Promise(case.name, right, case.said.from_nominal, case.transfer.from_nominal)
            )
    return (
        _summary("shrinkage of the explainable gap", explainable),
        _summary("shrinkage from the simulator as configured", nominal),
    )


def _summary(words: str, each: Sequence[Promise]) -> Promises:
    def inside(one: Promise) -> bool:
        return one.predicted.low <= one.realised.value <= one.predicted.high

    def meet(one: Promise) -> bool:
        return one.predicted.low <= one.realised.high and one.realised.low <= one.predicted.high

    def kept(one: Promise) -> bool:
        return one.realised.value >= one.predicted.low

    def less(right: bool) -> list[float]:
        return [o.realised.value - o.predicted.value for o in each if o.right == right]

    return Promises(
        words,
        tuple(each),
        (
            share("realised inside the predicted interval", map(inside, each)),
            share("intervals of both meet", map(meet, each)),
            share("realised at least the lower end", map(kept, each)),
            quantile("realised less predicted, median, answered right", less(True)),
            quantile("realised less predicted, median, others", less(False)),
        ),
    )
