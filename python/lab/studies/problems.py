# SPDX-License-Identifier: MIT
"""Problems that make an offline identification worthless, and the tests that find them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy.stats

from ehsid.harness.models.identification import (
    ArxModel,
    IdentificationResult,
    IoData,
    nearest_cancellation,
    poles_zeros,
    stability_distance,
)

# An instability counts only if it is this many standard deviations beyond the stability border and
# grows by a factor e within the validation part. An integrator estimated slightly outside the unit
# circle does neither.
SURE = 3.0
# Levels of the tests. A response counts as present if chance alone would give it in less than one
# record in a hundred. A common root is ruled out if chance alone would give such evidence against
# it in less than one record in twenty.
NO_RESPONSE_LEVEL = 0.01
CANCELLATION_LEVEL = 0.05


class Problem(StrEnum):
    """Names of the problems, for reports and exit codes."""

    TOO_SHORT = "too short"
    CONSTANT_INPUT = "constant input"
    CONSTANT_OUTPUT = "constant output"
    NO_EXCITATION = "no excitation"
    NO_RESPONSE = "no response"
    UNSTABLE = "unstable model"
    NON_MINIMAL = "non-minimal model"


@dataclass(frozen=True)
class Finding:
    """A problem, and its description in words with numbers."""

    problem: Problem
    text: str


def record_problems(data: IoData, split: float) -> tuple[Finding, ...]:
    """Finds parts of a record without samples, and signals that are constant within a part.

    Raises
    ------
    IdentificationError
        the split is out of range.
    """
    problems = []
    for part, what in zip(data.split(split), ("estimation", "validation"), strict=True):
        if not part.segments:
            problems.append(Finding(Problem.TOO_SHORT, f"The {what} part has no samples."))
            continue
        for signal, name, problem, mend in (
            (part.u, part.input_name, Problem.CONSTANT_INPUT, "excite the plant in both parts"),
            (part.y, part.output_name, Problem.CONSTANT_OUTPUT, "check sensor, supply and wiring"),
        ):
            values = signal[part.index]
            if np.ptp(values) == 0.0:
                text = f"'{name}' is {values[0]:g} throughout the {what} part: {mend}."
                problems.append(Finding(problem, text))
    return tuple(problems)


def model_problems(result: IdentificationResult) -> tuple[Finding, ...]:
    """Checks the chosen model for excitation, response, stability and common roots."""
    model = result.chosen.model
    checks = (
        _excitation(result),
        _response(model),
        _stability(model, result.n_validation),
        _minimality(model),
    )
    return tuple(finding for finding in checks if finding is not None)


def _excitation(result: IdentificationResult) -> Finding | None:
    """Checks whether only the lack of excitation of the input prevented a higher order."""
    limited = [
        rejected
        for rejected in result.rejected
        if rejected.orders.na > result.chosen.orders.na
        and all(name.startswith(("b", "offset")) for name in rejected.parameters)
    ]
    highest = max(candidate.orders.na for candidate in result.by_order)
    if not limited or result.chosen.orders.na < highest:
        return None
    tried = _listed(sorted({rejected.orders.na for rejected in limited}))
    return Finding(
        Problem.NO_EXCITATION,
        f"The data do not determine order {tried} ({limited[0].why}); order "
        f"{result.chosen.orders.na} was chosen for want of excitation, not on its merits.",
    )


def _response(model: ArxModel) -> Finding | None:
    """Tests b = 0 by a Wald test: chi-squared with nb degrees of freedom."""
    na, nb = model.orders.na, model.orders.nb
    cov = model.covariance[na : na + nb, na : na + nb]
    if not np.any(cov):
        return None
    statistic = float(model.b @ np.linalg.pinv(cov, hermitian=True) @ model.b)
    p_value = float(scipy.stats.chi2.sf(statistic, nb))
    if p_value < NO_RESPONSE_LEVEL:
        return None
    return Finding(
        Problem.NO_RESPONSE,
        f"The output does not respond to the input, to within noise: b = 0 in all of "
        f"{model.orders} has p = {p_value:.2g} (below {NO_RESPONSE_LEVEL:g} would be a response). "
        "Excite more strongly, or check which columns were read.",
    )


def _stability(model: ArxModel, n_validation: int) -> Finding | None:
    poles = poles_zeros(model).poles
    largest = complex(poles.values[0])
    growth = n_validation * math.log(max(abs(largest), 1e-300))
    if abs(largest) <= 1.0 or growth < 1.0:
        return None
    distance = stability_distance(model)
    if distance <= SURE:
        return None
    return Finding(
        Problem.UNSTABLE,
        f"The model {model.orders} is unstable: a pole at {_place(largest)}, |z| = "
        f"{abs(largest):.4f}, {distance:.1f} standard deviations beyond the border of stability; "
        f"its free run grows tenfold in {math.log(10.0) / math.log(abs(largest)):.0f} samples.",
    )


def _minimality(model: ArxModel) -> Finding | None:
    nearest = nearest_cancellation(model)
    if nearest is None or nearest.p_value < CANCELLATION_LEVEL:
        return None
    return Finding(
        Problem.NON_MINIMAL,
        f"A pole and a zero of {model.orders} cancel within their uncertainty at z = "
        f"{_place(nearest.place)} (p = {nearest.p_value:.2g}, a common root is ruled out below "
        f"{CANCELLATION_LEVEL:g}): a lower order says the same.",
    )


def _place(z: complex) -> str:
    return f"{z.real:.4f}" if z.imag == 0.0 else f"{z.real:.4f} ± {abs(z.imag):.4f}j"


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(str(number) for number in numbers)
