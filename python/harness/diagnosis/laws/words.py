# SPDX-License-Identifier: MIT
"""A law in words, by the simplest form that it has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.arrays import FloatArray
from ...base.plain_number import plain_number
from ...rigs.table_law import TableLaw
from ...rigs.table_words import OF_TERM, OF_VARIABLE, table_words
from ..schema import MissingLaw
from .forms import Form, forms_of

# A form fits where it leaves less than this share of the curve's mean square; a later one, which
# has more to adapt, where it leaves less than CLEARLY of what an earlier one leaves.
FITS = 0.05
CLEARLY = 0.2
# A form that leaves less than this share is taken, and none after it is tried.
EXACT = 0.002


@dataclass(frozen=True)
class Description:
    """Form of a law in words, and the simple form itself at the knots, in SI units, if it fits."""

    words: str
    form: tuple[float, ...] | None


def describe(law: TableLaw, weights: Sequence[float]) -> Description:
    """Describes the form of a law; weights: share of the samples at each knot."""
    x = np.array(law.knots, dtype=np.float64) * OF_VARIABLE[law.of][1]
    y = np.array(law.values, dtype=np.float64) * OF_TERM[law.adds_to][1]
    # No knot counts for nothing: the curve is there, too.
    root = np.sqrt(np.array(weights, dtype=np.float64) + 0.1 / len(law.knots))
    square = float(np.sum((root * y) ** 2))
    found, needed = Description(_range(x, y, law), None), FITS * square
    for form in forms_of(law):
        coefficients, shape, fitted = _fit(form, x, y, root)
        rest = float(np.sum((root * (y - fitted)) ** 2))
        words = form.words(coefficients, shape, law) if rest <= needed else None
        if words is not None:
            found = Description(words, tuple((fitted / OF_TERM[law.adds_to][1]).tolist()))
            needed = CLEARLY * rest
        if found.form is not None and needed < CLEARLY * EXACT * square:
            break
    return found


def sentence(laws: Sequence[MissingLaw]) -> str:
    """Returns what is missing in words, the law that was found first in front."""
    terms = [table_words(found.law.adds_to, found.law.of) for found in laws]
    if len(terms) == 1:
        return f"The simulator lacks a term: {terms[0]}. It {laws[0].looks_like}."
    return f"The simulator lacks {len(terms)} terms: {', and '.join(terms)}."


def _fit(
    form: Form, x: FloatArray, y: FloatArray, root: FloatArray
) -> tuple[FloatArray, float, FloatArray]:
    """Coefficients, shape and values of a form that is nearest to the points (least squares)."""
    best: tuple[float, FloatArray, float, FloatArray] | None = None
    for shape in form.shapes(x):
        matrix = np.column_stack(form.columns(x, float(shape)))
        solution, *_ = np.linalg.lstsq(matrix * root[:, np.newaxis], y * root, rcond=None)
        coefficients = np.asarray(solution, dtype=np.float64)
        fitted = matrix @ coefficients
        rest = float(np.sum((root * (y - fitted)) ** 2))
        if best is None or rest < best[0]:
            best = rest, coefficients, float(shape), fitted
    assert best is not None
    return best[1:]


def _range(x: FloatArray, y: FloatArray, law: TableLaw) -> str:
    low, high = int(np.argmin(y)), int(np.argmax(y))
    unit, of = OF_TERM[law.adds_to][0], OF_VARIABLE[law.of][0]
    return (
        f"lies between {plain_number(y[low], 3)} {unit} (at {plain_number(x[low], 3)} {of}) "
        f"and {plain_number(y[high], 3)} {unit} "
        f"(at {plain_number(x[high], 3)} {of})"
    )
