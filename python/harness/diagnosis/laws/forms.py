# SPDX-License-Identifier: MIT
"""The laws that are tried: equations, variables and sizes of terms, and forms over a variable.

A form is that of a named effect, or a line with one bend: a sum of columns over the variable, with
coefficients, and at most one value that shapes the columns (the width of a dead band, say).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

import ehsid

from ...base.numbers import FloatArray, plain_number
from ...catalogue.parameters import plain_name
from ...rigs import Rig
from ...rigs.rig import OF_TERM, OF_VARIABLE, TableLaw, table_words
from ..model.case import Case
from ..model.parameters import Law
from ..model.problem import Problem
from ..model.scale import machine_scale
from ..schema import MissingLaw
from ..search.candidates import FittedCandidate

# Rates are the slopes of outputs over this time: one simulated sample has steps.
RATE_S = 0.005
RATES = {
    "acceleration_m_s2": "velocity_m_s",
    "spool_rate_1_s": "spool",
    "pressure_a_rate_pa_s": "pressure_a_pa",
    "pressure_b_rate_pa_s": "pressure_b_pa",
}
LOAD_PRESSURE = "load_pressure_pa"
# The position where the rod extends, and its negative where it retracts: a law that differs by
# direction.
BY_DIRECTION = "position_by_direction_m"


def trajectories(problem: Problem, x: FloatArray) -> list[dict[str, FloatArray]]:
    """Variables of each record by name, shape (N,) each; without those that the plant lacks."""
    values = problem.plant_values(x)[np.newaxis]
    found = []
    for record in problem.records:
        outputs, _ = ehsid.simulate_plant(
            problem.rig.plant,
            values,
            record.record.column("command_v"),
            dt_s=record.dt_s,
            substeps=problem.substeps,
            aligned=record.aligned,
            tables=problem.rig.table_shapes(),
        )
        here = {
            name: np.asarray(column, dtype=np.float64)
            for name, column in zip(ehsid.plant_outputs(), outputs[0].T, strict=True)
            if np.isfinite(column).all()
        }
        for rate, name in RATES.items():
            if name in here:
                here[rate] = _rate(here[name], record.dt_s)
        if {"pressure_a_pa", "pressure_b_pa"} <= here.keys():
            here[LOAD_PRESSURE] = here["pressure_a_pa"] - here["pressure_b_pa"]
        here[BY_DIRECTION] = np.where(here["velocity_m_s"] < 0.0, -1.0, 1.0) * (
            here["position_m"] - float(np.min(here["position_m"]))
        )
        here["time_s"] = record.dt_s * np.arange(len(record.record), dtype=np.float64)
        found.append(here)
    return found


def _rate(signal: FloatArray, dt_s: float) -> FloatArray:
    length = max(1, round(RATE_S / dt_s))
    smooth = np.convolve(signal, np.full(length, 1.0 / length), mode="same")
    return np.asarray(np.gradient(smooth, dt_s), dtype=np.float64)


# Variables of each equation, as far as physics knows such laws: friction, springs and bearings;
# flow laws of the edges, leakage and air; errors of sensors; clocks that drift; linkages.
MENU: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "force": ("velocity_m_s", "position_m", "time_s"),
        "mass": ("position_m",),
        "flow_a": ("spool", "pressure_a_pa", "position_m", "time_s"),
        "flow_b": ("spool", "pressure_b_pa", "position_m", "time_s"),
        "spool": ("spool", "time_s"),
        "sensor": ("position_m", "time_s"),
        "delay": ("time_s",),
    }
)
# Standard deviation of a term by the prior: share of the largest force, of the mass, of the rated
# flow, of full opening, of the stroke; and seconds.
SHARE = MappingProxyType(
    {
        "force": 0.1,
        "mass": 0.3,
        "flow_a": 0.1,
        "flow_b": 0.1,
        "spool": 0.1,
        "sensor": 0.01,
        "delay": 0.01,
    }
)
# Below the pressure of the tank free gas decides, of which every oil has another share: a law over
# the pressure of a chamber begins there.
CHAMBERS = ("pressure_a_pa", "pressure_b_pa")
KNOTS = 12
# What moves with the rod: that of a servo, of an axis.
MASSES = ("load.mass_kg", "axis.mass_kg", "linear.mass_kg")
# Over the time a law may come and go several times.
KNOTS_OF_TIME = 30
# Share of the samples beyond the outer knots at either end.
TAIL = 0.002
# Friction and metering edges bend near zero: there knots are closer, on the scale asinh(x / x_0)
# with x_0 this share of the range.
BENDS_AT_ZERO = ("velocity_m_s", "spool")
NEAR_ZERO = 0.03


def laws(case: Case, candidate: FittedCandidate) -> list[Law]:
    """Returns the laws of the menu that the plant can have, over the range that the rod visited."""
    here = visited(case, candidate)
    scale = sizes(case)
    found = []
    for equation, variables in MENU.items():
        for variable in variables:
            if equation not in scale or variable not in here:
                continue
            places = knots_over(variable, here[variable], case.rig)
            if places is not None:
                law = Law(equation, variable, places, scale[equation])
                found.append(_with_free_name(law, case.rig))
    return found


def _with_free_name(law: Law, rig: Rig) -> Law:
    """A rig that an earlier diagnosis augmented has its laws already: a new one adds to them."""
    number = 2
    while law.name in rig.tables:
        law, number = replace(law, suffix=f"_{number}"), number + 1
    return law


def sizes(case: Case) -> dict[str, float]:
    """Sizes of terms by equation; without those that the plant does not have."""
    values = case.rig.values
    travel = values.get("cylinder.stroke_m") or float(
        max(np.ptp(record.column("position_m")) for record in case.records)
    )
    of = {"force": machine_scale(case.rig).force_n, "sensor": travel, "delay": 1.0}
    of["mass"] = sum(values.get(name, 0.0) for name in MASSES) or math.nan
    if case.rig.plant == "ehs":
        of |= {"flow_a": values["valve.rated_flow_m3_s"], "spool": 1.0}
        of["flow_b"] = of["flow_a"]
    return {name: SHARE[name] * unit for name, unit in of.items() if math.isfinite(unit)}


def visited(case: Case, candidate: FittedCandidate) -> dict[str, FloatArray]:
    """What the simulation of a candidate visits, by variable, all fitted records together."""
    problem = case.problem(candidate.effects, laws=candidate.laws)
    records = trajectories(problem, candidate.x)
    return {name: np.concatenate([here[name] for here in records]) for name in records[0]}


def knots_over(variable: str, samples: FloatArray, rig: Rig) -> FloatArray | None:
    """Knots of a table over a variable; None where it does not vary.

    samples: of the variable. Below the tank pressure a chamber holds a cavity, which no table has.
    """
    if variable in CHAMBERS:
        samples = samples[samples > rig.values["supply.tank_pressure_pa"]]
    count = KNOTS_OF_TIME if variable == "time_s" else KNOTS
    return knots(samples, count, bends=variable in BENDS_AT_ZERO)


def knots(samples: FloatArray, count: int, *, bends: bool) -> FloatArray | None:
    """Knots over what was visited, shape (count,); None where the variable does not vary."""
    if samples.size < count:
        return None
    low, high = np.quantile(samples, [TAIL, 1.0 - TAIL])
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        return None
    if not bends:
        return np.asarray(np.linspace(low, high, count))
    near = NEAR_ZERO * (high - low)
    ends = np.arcsinh(np.array([low, high]) / near)
    return np.asarray(near * np.sinh(np.linspace(ends[0], ends[1], count)))


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
MASS = ("mass", "position_m")
# What the lever of a linkage changes.
LINKAGE = frozenset({SPRING, MASS})


def is_linkage(laws: Iterable[Law]) -> bool:
    """Whether these laws are those of a lever, a mass over the position among them."""
    kinds = {(law.adds_to, law.of) for law in laws}
    return MASS in kinds and kinds <= LINKAGE


# The effect that a law is where its curve is a constant.
CONSTANTS = {"delay": "transport_delay", "force": "load_force", "spool": "valve_null_bias"}


def _constant(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x)]


def _constant_words(c: FloatArray, _: float, law: TableLaw) -> str:
    text = f"is nearly constant at {_term(c[0], law)}"
    effect = CONSTANTS.get(law.adds_to)
    return text if effect is None else f"{text}, as a {plain_name(effect)}"


def _line(x: FloatArray, _: float) -> list[FloatArray]:
    return [np.ones_like(x), x - 0.5 * (x[0] + x[-1])]


def _line_words(c: FloatArray, _: float, law: TableLaw) -> str:
    half_range = 0.5 * (law.knots[-1] - law.knots[0]) * OF_VARIABLE[law.of][1]
    text = _slope(c[1], law)
    if abs(c[0]) > 0.01 * abs(c[1]) * half_range:
        text += f", with {_term(c[0], law)} in the middle"
    if (law.adds_to, law.of) == SPRING and c[1] > 0.0:
        return f"{text}, as a load spring"
    if (law.adds_to, law.of) == SPRING:
        return f"{text}, as a load on a lever"
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
    if (law.adds_to, law.of) == SPRING and c[2] > TOUCHES * abs(c[1]):
        return (
            f"{_slope(c[2], law)} beyond {plain_number(at, 3)} {OF_VARIABLE[law.of][0]} and is "
            "nearly level before, as of something that the rod touches there"
        )
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
# Beyond a touch the force rises by this many times what it does before.
TOUCHES = 10.0
# A mass that changes by less is called constant.
LEAST_OF_LINKAGE = 0.05


@dataclass(frozen=True)
class Description:
    """Form of a law in words, and the simple form itself at the knots, in SI units, if it fits."""

    words: str
    form: tuple[float, ...] | None


def describe(law: TableLaw, weights: Sequence[float], mass_kg: float = 0.0) -> Description:
    """Describes the form of a law; weights: share of the samples at each knot.

    mass_kg: what moves with the rod without the law.
    """
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
    if (law.adds_to, law.of) == MASS:
        return Description(_mass_words(x, y + mass_kg), found.form)
    return found


def _mass_words(x: FloatArray, mass: FloatArray) -> str:
    """What the whole moving mass, kg, does over the position x, mm."""
    at = sorted((int(np.argmin(mass)), int(np.argmax(mass))))
    first, last = (mass[place] for place in at)
    least, most = min(first, last), max(first, last)
    if not least > 0.0:
        return f"reaches from {plain_number(least, 3)} to {plain_number(most, 3)} kg"
    if most < (1.0 + LEAST_OF_LINKAGE) * least:
        return f"is nearly constant at {plain_number(float(np.mean(mass)), 3)} kg"
    here, there = (f"{plain_number(mass[i], 3)} kg at {plain_number(x[i], 3)} mm" for i in at)
    verb = "grows" if last > first else "falls"
    by = plain_number(100.0 * abs(last / first - 1.0), 2)
    return f"{verb} by {by} %, from {here} to {there}, as in a linkage"


def sentence(laws: Sequence[MissingLaw]) -> str:
    """Returns what is missing in words, the law that was found first in front."""
    terms = [table_words(found.law.adds_to, found.law.of) for found in laws]
    if len(terms) == 1:
        return f"The simulator lacks a term: {terms[0]}. It {laws[0].looks_like}."
    text = f"The simulator lacks {len(terms)} terms: {', and '.join(terms)}."
    if {(found.law.adds_to, found.law.of) for found in laws} >= LINKAGE:
        return (
            f"{text} Both together are those of a linkage, such as a boom that the cylinder lifts."
        )
    return text


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
