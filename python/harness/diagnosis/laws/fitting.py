# SPDX-License-Identifier: MIT
"""Fits of laws without a name through the simulator, as any effect is fitted."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base.parallel import Progress, part_of, run_together
from ..decision.evidence import left
from ..model.case import Case
from ..model.fit import descent, fit
from ..model.law import Law
from ..model.linear import Linear
from ..search.candidates import FittedCandidate, decision_case, evaluate
from .menu import laws

# Steps of a short fit of each law of the menu, number of laws that get a long one, and its steps.
SHORT, KEPT, LONG = 3, 4, 12
# Share of the time that the short fits take.
SHORT_FITS = 0.6


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A candidate with one law more; `left`: the errors that it leaves, see `evidence.left`."""

    candidate: FittedCandidate
    left: float

    @property
    def law(self) -> Law:
        """The law that was added last."""
        return self.candidate.laws[-1]


def with_one_law(
    case: Case, candidate: FittedCandidate, progress: Progress | None = None
) -> list[FittedLaw]:
    """Adds each law of the menu to a candidate; returns the best few, fitted, best first."""
    fine = decision_case(case)
    shared = fine.problem(candidate.effects, laws=candidate.laws).linear(candidate.x)
    present = {law.name for law in candidate.laws}
    menu = [law for law in laws(fine, candidate) if law.name not in present]
    tasks = [partial(_short, fine, candidate, law, shared) for law in menu]
    short = run_together(tasks, part_of(progress, 0.0, SHORT_FITS))
    short.sort(key=lambda each: each.cost)
    longer = [partial(_long, fine, each) for each in short[:KEPT]]
    fitted = run_together(longer, part_of(progress, SHORT_FITS, 1.0))
    return sorted((FittedLaw(each, left(fine, each)) for each in fitted), key=lambda e: e.left)


def _short(case: Case, candidate: FittedCandidate, law: Law, shared: Linear) -> FittedCandidate:
    """A few steps from the candidate with the law at zero."""
    laws = (*candidate.laws, law)
    problem = case.problem(candidate.effects, laws=laws)
    start = np.concatenate([candidate.x, np.zeros(law.knots.size)])
    *_, last = itertools.islice(descent(problem, start, shared), SHORT)
    return evaluate(case, candidate.effects, last, laws)


def _long(case: Case, short: FittedCandidate) -> FittedCandidate:
    """A long fit, and another one where the law is larger than its prior had expected."""
    problem = case.problem(short.effects, laws=short.laws)
    fitted = evaluate(case, short.effects, fit(problem, short.x, iterations=LONG), short.laws)
    *others, law = fitted.laws
    z = fitted.x[-law.knots.size :]
    # The size s of the prior is estimated, too (empirical Bayes): s^2 <- s^2 mean(z^2). A law that
    # is pulled towards zero pushes the values of the rig away from theirs.
    larger = float(np.sqrt(np.mean(z**2)))
    if larger < 1.0:
        return fitted
    laws = (*others, replace(law, size=larger * law.size))
    start = np.concatenate([fitted.x[: -law.knots.size], z / larger])
    problem = case.problem(short.effects, laws=laws)
    return evaluate(case, short.effects, fit(problem, start, iterations=LONG), laws)
