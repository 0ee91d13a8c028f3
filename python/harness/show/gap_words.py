# SPDX-License-Identifier: MIT
"""Words and numbers of a diagnosis in readable form: verdicts, names, units and intervals.

Tables of a diagnosis in brief, as the command and the Python interface show them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from types import MappingProxyType

from ..catalogue.channels import shown_channel
from ..catalogue.families import effect_families
from ..catalogue.parameters import plain_name, plant_parameters, value_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.deciding import TOLD
from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import Candidate, Estimate, HowFar, Remark
from ..rigs.rig import table_words
from .page import SPACE, Table, Tagged
from .units import percent, percent_interval

# What the decision made of a candidate.
STANDINGS: MappingProxyType[str | None, str] = MappingProxyType(
    {
        "named": "named",
        "equivalent": "cannot be told apart",
        "sufficient": "sufficient",
        "not_sufficient": "not sufficient",
        "improbable": "too improbable",
        "not_needed": "not needed",
        "too_small": "size not counted",
        "worse": "larger errors",
        "screened": "short fit only",
    }
)

# What the words on a candidate mean that do not explain themselves.
NATS_NOTE = (
    "Nats behind: how far the log-likelihood of the held-out data is below that of the {chosen}; "
    "a negative number means smaller errors."
)
NOT_COUNTED_NOTE = (
    '"Size not counted": an effect of the set is no larger than in every servo, or it has sizes '
    "that no servo has; the set then has no probability."
)

# The unit that is shown in place of an SI unit, with its factor.
SHOWN_UNITS = MappingProxyType(
    {
        "m": (1e3, "mm"),
        "s": (1e3, "ms"),
        "Pa": (1e-5, "bar"),
        "m^3": (1e3, "l"),
        "m^3/s": (6e4, "l/min"),
        "m^3/(s Pa)": (6e9, "l/min per bar"),
        "m^3/(s Pa) of a leak": (6e11, "l/min at 100 bar"),
        "Pa s/m^3": (1e-5 / 6e3, "bar at 10 l/min"),
        "m^3/Pa": (1e8, "l/bar"),
        "1/s of a gain": (100.0, "% in a second"),
        "1": (1.0, ""),
    }
)
OF_WHAT = MappingProxyType(
    {
        "internal_leakage": " of a leak",
        "external_leakage": " of a leak",
        "leakage_m3_s_pa": " of a leak",
        "flow_gain_drift": " of a gain",
    }
)
# Digits and sign of a power of ten.
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
POWER = "·10"
# A value in Pa of this size or larger is a stiffness and is shown in MPa.
STIFF_PA = 1e8

# Names of the three simulations on the page.
SIMULATIONS = MappingProxyType(
    {
        "nominal": "simulator as configured",
        "calibrated": "rig values fitted",
        "augmented": "with what was found",
    }
)


def effect_set(effects: tuple[str, ...]) -> str:
    """Returns a set of effects in words."""
    return " + ".join(plain_name(effect) for effect in effects) or "no effect"


def chosen(candidates: Sequence[Candidate]) -> Candidate:
    """Returns the candidate that is named, or sufficient; the first one if none is."""
    decided = (
        each for each in candidates if each.standing in ("named", "sufficient", "not_sufficient")
    )
    return next(decided, candidates[0])


def candidate_notes(candidates: Sequence[Candidate]) -> str:
    """Returns what a reader needs in order to read a table with these candidates."""
    kinds = {candidate.standing for candidate in candidates}
    named = (
        "fit without effects"
        if kinds & {"sufficient", "not_sufficient"}
        else "named set"
        if "named" in kinds
        else "first set"
    )
    notes = [NATS_NOTE.format(chosen=named), *_other_laws(candidates)]
    return " ".join([*notes, NOT_COUNTED_NOTE] if "too_small" in kinds else notes)


def _other_laws(candidates: Sequence[Candidate]) -> list[str]:
    """Says how probable each set is that counts as the same answer as the named one."""
    best = chosen(candidates)
    alike = [
        f"{effect_set(each.effects)} has {percent(each.probability)}"
        for each in candidates
        if each.probability is not None
        and each.probability >= TOLD
        and effect_families(each.effects) == effect_families(best.effects)
    ]
    if len(alike) < 2:
        return []
    return [
        "Sets that act alike, such as two laws of friction, count as one answer. The probability "
        "of an effect is that of all of them: "
        f"{', '.join(alike)}."
    ]


def nats_behind(candidate: Candidate, other: Candidate) -> str:
    """Returns by how many nats a candidate is behind another one; negative if it is ahead."""
    return f"{round(candidate.score - other.score, 1) + 0.0:.1f}"


def unit_of(name: str) -> str:
    """Returns the SI unit of a value given by its full name; "1" where the value is not known.

    That of a share is "1 of" with the words for the whole. A unit says of what it is where people
    ask for it in another way: a leak at a pressure, a drift in per cent.
    """
    info = plant_parameters().get(name)
    if info is None:
        return "1"
    of = f" of {info.share_of}" if info.share_of else OF_WHAT.get(info.name.split(".")[1], "")
    return f"{info.unit}{of}"


def in_shown_unit(value: float, unit: str) -> tuple[float, str]:
    """Returns the factor from SI and the unit with which a value of this size is shown."""
    if unit == "Pa" and abs(value) >= STIFF_PA:
        return 1e-6, "MPa"
    if unit.startswith("1 of "):
        return 100.0, f"%{unit[1:]}"
    return SHOWN_UNITS.get(unit, (1.0, unit))


def number(value: float | None, digits: int = 4) -> str:
    """Returns a number with so many significant digits; a dash where it is None or not finite.

    Numbers from 1e-3 to below 1e7 have no exponent.
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if -4 < exponent < 7:
        return f"{value:.{max(0, digits - 1 - exponent)}f}"
    mantissa, power = f"{value:.{max(0, digits - 1)}e}".split("e")
    return f"{mantissa}{POWER}{str(int(power)).translate(RAISED)}"


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """Returns a value (given in `unit`, SI) with its shown unit, without trailing zeros."""
    factor, shown = in_shown_unit(value, unit)
    text = number(factor * value, digits)
    if "." in text and POWER not in text:
        text = text.rstrip("0").rstrip(".")
    return with_unit(text, shown)


def with_unit(text: str, unit: str) -> str:
    """Joins a number and its unit so that they stay on one line."""
    return f"{text}{SPACE}{unit}" if unit else text


def _digits(estimate: Estimate) -> int:
    """Number of significant digits that shows two digits of the width of the interval.

    It refers to the largest of value and ends; it is 2 to 7, and 4 for an interval without width.
    """
    width = estimate.high - estimate.low
    largest = max(abs(estimate.low), abs(estimate.high), abs(estimate.value))
    if not (width > 0.0 and math.isfinite(width) and largest > 0.0):
        return 4
    return min(7, max(2, math.floor(math.log10(largest)) - math.floor(math.log10(width)) + 2))


def interval(estimate: Estimate, unit: str) -> tuple[str, str]:
    """Returns a value with its shown unit, and its interval in the same unit."""
    factor, shown = in_shown_unit(estimate.value, unit)
    digits = _digits(estimate)
    places = _places(factor * max(abs(estimate.low), abs(estimate.high)), digits)
    if places is None:
        low, high = (number(factor * end, digits) for end in (estimate.low, estimate.high))
        value = number(factor * estimate.value, digits)
    else:
        low, high, value = (
            f"{factor * part:.{places}f}" if math.isfinite(part) else "–"
            for part in (estimate.low, estimate.high, estimate.value)
        )
    return with_unit(value, shown), f"{low} to {high}"


def _places(largest: float, digits: int) -> int | None:
    """Number of decimals that shows so many significant digits of the largest number.

    None where the number is not positive and finite, or is better shown with an exponent.
    """
    if not (math.isfinite(largest) and largest > 0.0):
        return None
    exponent = math.floor(math.log10(largest))
    return max(0, digits - 1 - exponent) if -4 < exponent < 7 else None


def first_upper(text: str) -> str:
    """Returns the text with its first letter in upper case; the rest is unchanged."""
    return text[:1].upper() + text[1:]


def named_effect(effect: str) -> Tagged:
    """Returns the cell with the name of an effect."""
    return Tagged(plain_name(effect), hint=effect)


def named_effects(effects: Sequence[str], before: str = "", tag: str = "") -> Tagged:
    """Returns the cell with the name of a set of effects; `before` and `tag` stand around it."""
    return Tagged(before + effect_set(tuple(effects)), tag, " + ".join(effects))


# More candidates than this are easier to read on the page.
MOST_CANDIDATES = 5


def told_reasons(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Returns the reasons of the verdict that its sentence does not say already."""
    return tuple(reason for reason in diagnosis.reasons if reason not in diagnosis.sentence)


def told_remarks(diagnosis: Diagnosis) -> tuple[Remark, ...]:
    """Returns the remarks on the records that no reason of the verdict says already."""
    reasons = " ".join(diagnosis.reasons)
    return tuple(
        remark
        for remark in diagnosis.remarks
        if not (remark.serious and remark.what.rstrip(".") in reasons)
    )


def summary_tables(diagnosis: Diagnosis) -> Iterator[Table]:
    """Yields the tables that a diagnosis has something for, the gap first."""
    if diagnosis.how_far is not None:
        added = bool(diagnosis.effects or diagnosis.missing_laws)
        yield _gap(diagnosis.how_far, added=added)
    if diagnosis.where.subsystem:
        shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
        rows = [(name, percent(share)) for name, share in shares]
        yield Table("", ("where", "share of the gap"), rows)
    if diagnosis.effects:
        sizes = [
            (
                *((plain_name(effect.id), percent(effect.probability)) if i == 0 else ("", "")),
                *interval(size, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for effect in diagnosis.effects
            for i, (name, size) in enumerate(effect.parameters.items())
        ]
        yield Table("", ("effect", "probability", "size", "90 % interval"), sizes)
    if diagnosis.missing_laws:
        laws = [
            (
                table_words(found.law.adds_to, found.law.of),
                found.looks_like,
                percent(found.share_of_shrinkage),
            )
            for found in diagnosis.missing_laws
        ]
        yield Table("", ("missing law", "its form", "share of what is removed"), laws)
    if diagnosis.candidates:
        yield _candidates(diagnosis.candidates)
    moved = [
        (
            value_name(name),
            quantity(value.rig, unit_of(name)),
            *interval(value.found, unit_of(name)),
        )
        for name, value in diagnosis.calibration.items()
        if value.moved
    ]
    if moved:
        yield Table("", ("value that moved", "rig file", "estimate", "90 % interval"), moved)


def _candidates(candidates: Sequence[Candidate]) -> Table:
    """The first candidates, and the one that was chosen wherever it stands."""
    best = chosen(candidates)
    shown = list(candidates[:MOST_CANDIDATES])
    if not any(candidate is best for candidate in shown):
        shown[-1] = best
    rows = [
        (
            effect_set(candidate.effects),
            percent(candidate.held_out_shrinkage),
            nats_behind(candidate, best),
            "" if candidate.probability is None else percent(candidate.probability),
            STANDINGS[candidate.standing],
        )
        for candidate in shown
    ]
    headings = ("candidate", "removes", "nats behind", "probability", "decision")
    return Table("", headings, rows, note=candidate_notes(shown))


def _gap(gap: HowFar, *, added: bool) -> Table:
    """added: whether effects or laws were added to the last simulation."""
    floor = " to ".join(map(percent, gap.noise_floor))
    means = (gap.nominal, gap.calibrated, gap.augmented)
    rows = [("all outputs", *map(percent, means), floor)]
    rows += [
        (f"  {shown_channel(name)[0]}", *map(percent, gaps), "")
        for name, gaps in gap.per_output.items()
    ]
    caption = ""
    if added and gap.of_explainable is not None:
        caption = (
            f"What was found removes {percent_interval(gap.of_explainable)} of the gap above the "
            "noise floor that remained after the fit. The range is for other motions of this "
            "machine."
        )
    headings = ("gap on held-out data", *SIMULATIONS.values(), "floor")
    return Table("", headings, rows, note=caption)
