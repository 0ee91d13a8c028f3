# SPDX-License-Identifier: MIT
"""Shrinkage that was promised on held-out data against that on the third record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.gap.schema import Estimate
from ehsid.harness.validation.scoring.figures import Figure, quantile, share
from ehsid.harness.validation.scoring.judged_case import Scored


@dataclass(frozen=True)
class Promise:
    """Of one case: the share that was predicted with its interval, and the one realised."""

    case: str
    right: bool
    predicted: Estimate
    realised: Estimate


@dataclass(frozen=True)
class Promises:
    """Of one measure of shrinkage.

    Attributes
    ----------
    words
        which measure.
    each
        cases in which an effect was named.
    figures
        share of cases whose realised value lies in the predicted interval, in which the two
        intervals meet, and in which it lies above its lower end; median of what is realised less
        what was predicted, of cases that were answered right and of the others.
    """

    words: str
    each: tuple[Promise, ...]
    figures: tuple[Figure, ...]


def promises(cases: Sequence[Scored]) -> tuple[Promises, ...]:
    """Of both measures."""
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
