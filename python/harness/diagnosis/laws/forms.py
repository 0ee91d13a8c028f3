# SPDX-License-Identifier: MIT
"""Simple forms that a law may have: those of named effects, and lines with one bend.

A form is a sum of columns over the variable, with coefficients, and at most one value that shapes
the columns (the width of a dead band, say). All are in units for people, see `rigs.table_words`.

A law in words, by the simplest form that it has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray, plain_number
from ...rigs.rig import OF_TERM, OF_VARIABLE, TableLaw, table_words
from ..schema import MissingLaw

Columns = Callable[[FloatArray, float], list[FloatArray]]
Words = Callable[[FloatArray, float, TableLaw], str | None]


@dataclass(frozen=True)
class Form:
    """Columns at the points x, shape (K,), for a value of the shape, and the words for a fit.

    The words are None where the coefficients do not make sense for this form. `shapes`: the values
    that are tried, from the points; by default there is no such value.
    """

    columns: Columns
    words: Words
    shapes: Callable[[FloatArray], FloatArray] = lambda _: np.zeros(1)


def forms_of(law: TableLaw) -> list[Form]:
    """Returns the forms that a law may have, the simplest first."""
    found = [Form(_constant, _constant_words), Form(_line, _line_words)]
    both_sides = law.knots[0] < 0.0 < law.knots[-1]
    if both_sides:
        found += [Form(_jump, _jump_words)]
    if both_sides and (law.adds_to, law.of) == FRICTION:
        found += [
            Form(_jump_and_line, _friction_words),
            Form(_stribeck, _stribeck_words, _widths),
            Form(_drag, _drag_words),
        ]
    if both_sides and law.adds_to == "spool" and law.of == "spool":
        found += [
            Form(_dead_band, _dead_band_words, _widths),
            Form(_saturation, _saturation_words, _limits),
        ]
    return [*found, Form(_bend, _bend_words, lambda x: x[1:-1])]


FRICTION = ("force", "velocity_m_s")
SPRING = ("force", "position_m")
# Constant terms that have a name.
CONSTANTS = {"force": "a load force", "spool": "a null bias", "delay": "a transport delay"}


def _constant(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x)]


def _constant_words(c: FloatArray, _: float, law: TableLaw) -> str:
    text = f"is nearly constant at {_term(c[0], law)}"
    return f"{text}, as {CONSTANTS[law.adds_to]}" if law.adds_to in CONSTANTS else text


def _line(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x), x - 0.5 * (x[0] + x[-1])]


def _line_words(c: FloatArray, _: float, law: TableLaw) -> str:
    half_range = 0.5 * (law.knots[-1] - law.knots[0]) * OF_VARIABLE[law.of][1]
    text = _slope(c[1], law)
    if abs(c[0]) > 0.01 * abs(c[1]) * half_range:
        text += f", with {_term(c[0], law)} in the middle"
    if (law.adds_to, law.of) == SPRING and c[1] > 0.0:
        return f"{text}, as a load spring"
    if (law.adds_to, law.of) == FRICTION and c[1] > 0.0:
        return f"{text}, as viscous friction"
    return text


def _jump(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x), np.sign(x)]


def _jump_words(c: FloatArray, _: float, law: TableLaw) -> str:
    text = f"jumps by {_term(2.0 * c[1], law)} at zero and is level on both sides"
    if (law.adds_to, law.of) == FRICTION and c[1] > 0.0:
        return f"{text}, as Coulomb friction of {_term(c[1], law)}"
    if (law.adds_to, law.of) == ("spool", "spool") and c[1] < 0.0:
        return f"{text}, as a dead band of {_term(-c[1], law)}"
    return text


def _jump_and_line(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x), np.sign(x), x]


def _friction_words(c: FloatArray, _: float, law: TableLaw) -> str | None:
    if c[1] <= 0.0:
        return None
    return f"jumps by {_term(2.0 * c[1], law)} at zero and {_slope(c[2], law)} on both sides"


def _stribeck(x: FloatArray, width: float) -> list[FloatArray]:
    return [np.ones_like(x), np.sign(x), np.sign(x) * np.exp(-np.abs(x) / width)]


def _stribeck_words(c: FloatArray, width: float, law: TableLaw) -> str | None:
    if c[2] <= 0.0:
        return None
    return (
        f"falls from {_term(c[1] + c[2], law)} near rest to {_term(c[1], law)} beyond "
        f"{plain_number(width, 3)} {OF_VARIABLE[law.of][0]}, as Stribeck friction"
    )


def _drag(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x), x, x * np.abs(x)]


def _drag_words(c: FloatArray, _: float, law: TableLaw) -> str | None:
    if c[2] <= 0.0:
        return None
    return "grows with the square of the velocity, as turbulent drag"


def _dead_band(x: FloatArray, width: float) -> list[FloatArray]:
    return [np.ones_like(x), x, -np.clip(x, -width, width)]


def _dead_band_words(c: FloatArray, width: float, law: TableLaw) -> str | None:
    # Inside the band the whole opening is lost: the slope there is -1, beyond it nearly 0.
    if not 0.5 < c[2] < 1.5:
        return None
    return f"takes the first {_term(c[2] * width, law)} on each side of null, as a dead band"


def _saturation(x: FloatArray, limit: float) -> list[FloatArray]:
    return [np.ones_like(x), x, limit * np.tanh(x / limit)]


def _saturation_words(c: FloatArray, limit: float, law: TableLaw) -> str | None:
    # The term is gain (limit tanh(x / limit)) - x, up to a gain of the valve.
    if c[2] <= 0.0 or c[1] >= 0.0:
        return None
    return f"takes more the further the valve opens, as a saturation near {_term(limit, law)}"


def _bend(x: FloatArray, at: float) -> list[FloatArray]:
    return [np.ones_like(x), np.minimum(x - at, 0.0), np.maximum(x - at, 0.0)]


def _bend_words(c: FloatArray, at: float, law: TableLaw) -> str:
    return (
        f"{_slope(c[1], law)} up to {plain_number(at, 3)} {OF_VARIABLE[law.of][0]}, "
        f"then {_slope(c[2], law)}; "
        f"it is {_term(c[0], law)} there"
    )


def _widths(x: FloatArray) -> FloatArray:
    reach = min(-x[0], x[-1])
    return np.asarray(reach * np.geomspace(0.02, 0.7, 24), dtype=np.float64)


def _limits(x: FloatArray) -> FloatArray:
    reach = max(-x[0], x[-1])
    return np.asarray(reach * np.geomspace(0.2, 2.0, 24), dtype=np.float64)


def _term(value: float, law: TableLaw) -> str:
    return f"{plain_number(value, 3)} {OF_TERM[law.adds_to][0]}"


def _slope(value: float, law: TableLaw) -> str:
    verb = "rises" if value > 0.0 else "falls"
    return f"{verb} {_term(abs(value), law)} per {OF_VARIABLE[law.of][0]}"


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
