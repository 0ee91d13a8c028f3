# SPDX-License-Identifier: MIT
"""Negative control: answers permuted among the cases must score no better than chance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.validation.scoring.judged_case import Scored, by
from ehsid.harness.validation.scoring.reading import Answer, Said
from ehsid.harness.validation.scoring.right import judge

DEALS = 10_000
SEED = 6

# Whether a diagnosis is right for an answer.
Test = Callable[[Answer, Said], bool]


@dataclass(frozen=True)
class Control:
    """Result of a permutation test.

    Attributes
    ----------
    words
        what is counted.
    real
        share of the cases of the check that pass the test.
    chance
        exact mean of this share over all permutations of the answers among cases with the same
        sensors.
    mean, low, high
        mean of the share over the drawn permutations, and the limits that contain 90 % of them.
    p_value
        share of the permutations, the real order among them, that do as well or better; never 0
        (B. Phipson, G. Smyth, Stat. Appl. Genet. Mol. Biol. 9(1), 2010).
    deals
        number of drawn permutations.
    """

    words: str
    real: float
    chance: float
    mean: float
    low: float
    high: float
    p_value: float
    deals: int


def controls(cases: Sequence[Scored]) -> tuple[Control, ...]:
    """Returns the controls of the whole diagnosis and of the first name.

    Returns none without cases, and none where a true effect was left out: the list of effects left
    out would then reveal the truth.
    """
    if not cases or any(case.left_out for case in cases):
        return ()
    return (
        control("verdict and effects right", cases, lambda a, s: judge(a, s).right),
        control("effect named first", cases, lambda a, s: judge(a, s).effect_first is True),
    )


def control(
    words: str, cases: Sequence[Scored], test: Test, *, deals: int = DEALS, seed: int = SEED
) -> Control:
    """Permutes the answers at random among cases with the same sensors, `deals` times.

    Everything else stays: the diagnoses, and how often each diagnosis and each truth occurs.
    """
    rng = np.random.default_rng(seed)
    real, chance, dealt = 0.0, 0.0, np.zeros(deals)
    for group in by(cases, lambda case: case.answer.sensors).values():
        right = _table(group, test)
        n = len(group)
        real += float(np.trace(right))
        chance += float(right.mean(axis=0).sum())
        said = np.arange(n)
        dealt += np.array([right[rng.permutation(n), said].sum() for _ in range(deals)])
    as_good = int(np.count_nonzero(dealt >= real))
    low, high = np.quantile(dealt, [0.05, 0.95]) / len(cases)
    return Control(
        words,
        real / len(cases),
        chance / len(cases),
        float(dealt.mean()) / len(cases),
        float(low),
        float(high),
        (as_good + 1) / (deals + 1),
        deals,
    )


def _table(group: Sequence[Scored], test: Test) -> FloatArray:
    """Test results, (n, n): 1 where the answer of the row's case suits the column's diagnosis."""
    return np.array([[test(a.answer, s.said) for s in group] for a in group], dtype=np.float64)
