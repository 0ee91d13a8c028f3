# SPDX-License-Identifier: MIT
"""Units: as pint knows them, and as engineers write them, which becomes the notation of pint.

Only the spellings listed here are understood in a log. pint alone reads too much: a rod is a length
to it, and "Mm" a megameter. What is not understood is never taken for a column without a unit.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from tokenize import TokenError
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND

if TYPE_CHECKING:
    import pint

# pint evaluates the text that it parses, and "m**9**9**9" would never end. The text may therefore
# contain one power only, and no number of more than one digit.
_UNIT_TEXT = re.compile(r"(?!.*\d\d)(?!.*(\*\*|\^).*(\*\*|\^))[\w */^().°%-]{0,40}")
# A unit of a column may begin with a factor, as in "0.1 mm".
_FACTOR = re.compile(r"(\d{1,9}(?:\.\d{1,12})?(?:e[+-]?\d{1,2})?)\s+([^\W\d].*)")

# Pressures of the schema are absolute. A gauge reads zero at the standard atmosphere.
ATMOSPHERE_PA = 101325.0
# Gauge units, each with its size in pascals.
GAUGES = MappingProxyType(
    {
        "Pag": 1.0, "hPag": 1e2, "mbarg": 1e2, "kPag": 1e3, "barg": 1e5, "MPag": 1e6,
        "psig": 6894.757293168361, "ksig": 6894757.293168361, "atg": 98066.5,
    }
)  # fmt: skip


# Units that messages name, by the unit of the schema; the first are examples, the others only words
# that a misspelt unit may have meant.
EXAMPLES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "m": ("mm", "cm", "m", "in"),
        "s": ("s", "ms", "us"),
        "V": ("V", "mV"),
        "Pa": ("bar", "kPa", "MPa", "psi"),
        "m/s": ("mm/s", "cm/s", "m/s"),
        "N": ("N", "kN", "lbf"),
        "degC": ("degC", "degF", "kelvin"),
        "1": ("percent",),
    }
)
FURTHER_UNITS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "m": ("millimeter", "centimeter", "micrometer", "meter", "inch"),
        "s": ("second", "millisecond", "microsecond", "minute"),
        "V": ("volt", "millivolt"),
        "Pa": ("pascal", "kilopascal", "megapascal", "millibar", "barg", "psig"),
        "m/s": ("meter/second", "millimeter/second"),
        "N": ("newton", "kilonewton", "kgf"),
        "degC": ("celsius", "fahrenheit"),
    }
)

_LENGTHS = {
    "m": "m meter metre meters metres", "dm": "dm", "cm": "cm centimeter centimetre centimeters",
    "mm": "mm millimeter millimetre millimeters millimetres", "nm": "nm",
    "um": "um micron microns micrometer micrometre mikrometer", "ft": "ft foot feet",
    "inch": 'in inch inches zoll "', "thou": "mil mils thou",
}  # fmt: skip
_TIMES = {
    "s": "s sec secs second seconds sek sekunde sekunden secondes segundos secondi",
    "ms": "ms msec msecs millis millisecond milliseconds millisekunden",
    "us": "us usec usecs microsecond microseconds", "ns": "ns nsec nanosecond nanoseconds",
    "min": "min minute minutes minuten", "h": "h hr hrs hour hours std stunden",
    "day": "d day days tage",
}  # fmt: skip
# Written without the signs of a power: kg/cm^2 and kg/cm² are kg/cm2.
_PRESSURES = {
    "Pa": "pa pascal n/m2", "hPa": "hpa", "kPa": "kpa kilopascal kn/m2", "mbar": "mbar millibar",
    "MPa": "mpa megapascal n/mm2 mn/m2", "bar": "bar bars dan/cm2", "atm": "atm", "ksi": "ksi",
    "psi": "psi lbf/in2 lb/in2 lbs/in2", "at": "at kgf/cm2 kg/cm2 kp/cm2 kgf/sqcm kg/sqcm",
    "torr": "torr mmhg",
}  # fmt: skip
# Masses are what the display of a force sensor shows.
_FORCES = {
    "N": "n newton newtons", "daN": "dan", "kN": "kn kilonewton", "kip": "kip kips klbf",
    "lbf": "lbf lbs lb", "kgf": "kgf kp kg kilopond", "gram_force": "g gf",
    "force_metric_ton": "t to ton tonne tonnen tf",
}  # fmt: skip
_OTHERS = {
    "V": "v volt volts", "mV": "mv millivolt millivolts", "mA": "ma milliampere",
    "A": "a amp amps ampere", "percent": "% pct percent prozent", "1": "1 - frac fraction",
    "0.1 percent": "‰ permille promille",
    "degC": "°c degc c celsius gradc", "kelvin": "k kelvin", "degF": "°f degf f fahrenheit",
    "inch/s": "ips", "ft/min": "fpm",
}  # fmt: skip
# Spellings in which the case counts: millipascal and megavolt are as likely as MPa and mV.
_EXACT = MappingProxyType({"MN": "MN", "mN": "mN", "mPa": None, "MV": None, "Mn": None})
# Units of quantities that no channel has.
_NO_CHANNEL_WORDS = """
l/min lpm gpm l/s l/h l cm3 m3/s m3/h cm3/s hz khz rpm 1/min u/min min-1 1/s rad rad/s deg deg/s °
°/s grad nm knm n*m w kw va wh kwh j kg/s kg/m3 g/cm3 m/s2 mm/s2 ohm kohm uf cst mm2/s m2 cm2 mm2 db
"""
_NO_CHANNEL = frozenset(_NO_CHANNEL_WORDS.split())
_FULL_RANGE = re.compile(
    r"(?:%|pct|percent|prozent)\s*(?:of|vom|von|v\.|der|des|de|du|della|del)?\s*(?:the\s+)?"
    r"(?:full\s*|max\w*\s*|rated\s*|nominal\s*|nenn\s*)*(?:fso?|fsd|scale|range|stroke|travel|hub(?:es)?|"
    r"rated|max\w*|nominal|opening|command|signal|öffnung|endwert|nennwert)?\.?",
    re.IGNORECASE,
)
_NUMBER = r"10\^-?\d{1,2}|\d+(?:[.,]\d+)?(?:e[+-]?\d{1,2})?"
# "1/10 mm", "0,1 mm", "10mm", "1e-3*V", and "mm/10".
_WRITTEN_FACTOR = re.compile(
    rf"(?P<a>{_NUMBER})(?:\s*/\s*(?P<b>{_NUMBER}))?\s*\*?\s*(?P<unit>[^\W\d_].*|[%°\"‰].*)"
    rf"|(?P<whole>.*[^\W\d_])\s*/\s*(?P<c>{_NUMBER})",
    re.IGNORECASE,
)
# A number such as 1.000 may be one or one thousand.
_THOUSANDS = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")
REFERENCE = re.compile(
    r"(?P<unit>.+?)[\s_.]*[(\[]?\s*(?:(?P<gauge>g|ga|gauge|gage|rel|relativ|relative|ü|ue|überdruck|"
    r"man|manometric)|a|abs|absolut|absolute)\.?\s*[)\]]?\.?",
    re.IGNORECASE,
)
# Seconds of a unit of time.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86400.0}
# Units of a command that no rule converts into volts: the number is kept.
_OF_COMMANDS = frozenset({"mA", "A", "percent", "0.1 percent", "1"})


@cache
def unit_registry(number: type = float) -> pint.UnitRegistry[Any]:
    """Returns the units that pint knows and those of gauge pressures; numbers are of this type."""
    # pint is imported only where it is needed: its import takes longer than most commands run.
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(non_int_type=number)
    for name, size_pa in GAUGES.items():
        registry.define(f"{name} = {size_pa!r} * pascal; offset: {ATMOSPHERE_PA:.0f}")
    return registry


def _parsable(schema_unit: str) -> str:
    return "" if schema_unit == "1" else schema_unit  # "1" is a number to pint, not a unit


def is_unit(unit: object, schema_unit: str) -> bool:
    """Returns whether `unit` is the text of a unit, without a factor, of the same quantity."""
    if not isinstance(unit, str) or not _UNIT_TEXT.fullmatch(unit):
        return False
    # Not below `try`: a pint that cannot be loaded is no unit that is unknown.
    units = unit_registry()
    try:
        return bool(units.Unit(unit).is_compatible_with(_parsable(schema_unit)))
    except (
        ArithmeticError,
        AttributeError,
        ValueError,
        TypeError,
        AssertionError,
        TokenError,
    ):
        return False  # pint has no common exception for text that is not a unit


# Base units of the SI by the dimension that pint gives them.
_BASES = MappingProxyType({"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A"})


def base_exponents(unit: str) -> dict[str, int]:
    """Returns the exponents of kg, m, s and A in a unit of the values of a rig, such as "N s/m"."""
    dimensions = dict(unit_registry().Unit(_parsable(unit)).dimensionality)
    return {base: round(float(dimensions[of])) for of, base in _BASES.items() if of in dimensions}  # type: ignore[arg-type]


def split_factor(unit: str) -> tuple[float, str]:
    """Returns the factor before a unit, 1 without one, and the unit."""
    match = _FACTOR.fullmatch(unit)
    return (1.0, unit) if match is None else (float(match[1]), match[2])


def is_convertible(unit: object, schema_unit: str) -> bool:
    """Returns whether `unit` is the text of a unit, or of multiples of one, of this quantity."""
    if not isinstance(unit, str):
        return False
    factor, plain = split_factor(unit)
    return 0.0 < factor < math.inf and is_unit(plain, schema_unit)


def gauge_remarks(units: Mapping[str, str | None]) -> tuple[str, ...]:
    """Returns a remark on columns with gauge pressures, from the unit of each column."""
    gauges = [name for name, unit in units.items() if unit and split_factor(unit)[1] in GAUGES]
    if not gauges:
        return ()
    listed = ", ".join(f"'{name}'" for name in gauges)
    return (
        f"gauge pressures become absolute: one standard atmosphere, {ATMOSPHERE_PA:.0f} Pa, is "
        f"added to {listed}",
    )


def usual_units(unit: object, schema_unit: str) -> str:
    """Returns examples of units that convert into one of the schema, and what `unit` may mean."""
    *first, last = EXAMPLES[schema_unit]
    examples = f"{', '.join(first)} or {last}" if first else last
    words = (*EXAMPLES[schema_unit], *FURTHER_UNITS.get(schema_unit, ()))
    near = get_close_matches(str(unit).casefold(), [word.casefold() for word in words], n=1)
    found = next((word for word in words if near and word.casefold() == near[0]), None)
    return f"such as {examples}" + (f"; did you mean {found}?" if found else "")


def in_schema_unit(values: FloatArray, unit: str | None, schema_unit: str) -> FloatArray:
    """Returns the values, shape (n,), converted from the unit of the file to the schema unit."""
    if unit is None:
        return values
    factor, plain = split_factor(unit)
    quantity = unit_registry().Quantity(values if factor == 1.0 else factor * values, plain)
    with np.errstate(over="ignore"):  # the record refuses infinite values
        return np.asarray(quantity.to(_parsable(schema_unit)).magnitude, dtype=np.float64)


@cache
def _spellings() -> dict[str, tuple[str, ...]]:
    """Returns the units of a spelling in lower case; "h" may be of one quantity only."""
    found: dict[str, tuple[str, ...]] = {}
    for table in (_LENGTHS, _TIMES, _PRESSURES, _FORCES, _OTHERS):
        for unit, spellings in table.items():
            for spelling in spellings.split():
                found[spelling] = (*found.get(spelling, ()), unit)
    return found


def pint_unit(text: str, channel: str) -> str | None:
    """Returns the notation of `ColumnMap` for a unit of a channel as a log has it; None if none.

    "1" stands for a plain number, for a command also the units that are not converted.
    """
    written = _plain(text)
    if not written:
        return "1" if CHANNELS[channel].unit == "1" or channel == COMMAND else None
    unit = _one(written, channel)
    if unit is not None:
        return unit
    for factor, of in _multiples(written):
        unit = _one(of, channel)
        if unit is not None and not unit[0].isdigit():
            return unit if factor == 1.0 else f"{factor:.12g} {unit}"
    return None


def _plain(text: str) -> str:
    """Returns a unit with plain letters: µ and μ are u, ² is 2, ⁻¹ is ^-1; without brackets."""
    marked = text.replace("⁻", "^-").replace("·", "*").replace("**", "^")
    plain = unicodedata.normalize("NFKC", marked)
    plain = plain.replace("μ", "u").replace("\N{MINUS SIGN}", "-").strip()
    for pair in ("[]", "()"):
        if plain[:1] == pair[0] and plain.find(pair[1]) == len(plain) - 1:
            plain = plain[1:-1].strip()
    return plain


def _multiples(text: str) -> Iterator[tuple[float, str]]:
    """Yields the factor and the unit of which a text states multiples, such as (0.1, "mm")."""
    match = _WRITTEN_FACTOR.fullmatch(text)
    if match is None or _THOUSANDS.search(text):
        return
    a, b, c = (_number(match[key]) for key in ("a", "b", "c"))
    factor = 1.0 / c if match["c"] and c else a / b if b else 0.0
    if 0.0 < factor < np.inf:
        yield factor, match["unit"] or match["whole"]


def _number(text: str | None) -> float:
    if text is None:
        return 1.0
    return float(text.replace(",", ".").replace("10^", "1e"))


def _one(text: str, channel: str) -> str | None:
    """Returns the unit of a channel in a text without a factor."""
    for unit in _candidates(text):
        if channel == COMMAND and unit in _OF_COMMANDS:
            return unit
        if unit == "1":
            if CHANNELS[channel].unit == "1":
                return "1"
        elif is_convertible(unit, CHANNELS[channel].unit):
            return unit
    return None


def _candidates(text: str) -> Iterator[str]:
    if text in _EXACT:
        exact = _EXACT[text]
        yield from () if exact is None else (exact,)
        return
    short = re.sub(r"\s*(?:\^|/)\s*", lambda match: match[0].strip().strip("^"), text).casefold()
    yield from _spellings().get(short, _spellings().get(short.replace(" ", ""), ()))
    way, _, per = re.sub(r"[\s*.]+(\w+?)\^?-1$", r"/\1", text.casefold()).partition("/")
    lengths, times = (
        [unit for unit in _spellings().get(one.strip(), ()) if unit in of]
        for one, of in ((way, _LENGTHS), (per, _TIMES))
    )
    if lengths and times:
        yield f"{lengths[0]}/{times[0]}"
    if " since " in text:  # of times, in the conventions of netCDF
        yield from _candidates(text.partition(" since ")[0])
    if _FULL_RANGE.fullmatch(text):
        yield "percent"
    reference = REFERENCE.fullmatch(text)
    if reference is not None:
        pressures = [unit for unit in _candidates(reference["unit"]) if unit in _PRESSURES]
        gauges = [f"{unit}g" for unit in pressures if f"{unit}g" in GAUGES]
        yield from gauges if reference["gauge"] else pressures


def is_unit_of_another(text: str) -> bool:
    """Whether a text is a unit of some channel, or of a quantity that no channel has."""
    written = _plain(text)
    if _FULL_RANGE.fullmatch(written) and " " in written:
        return False  # a percentage of something: of the stroke it is a position
    plain = re.sub(r"\s|\^", "", written).casefold()
    return plain in _NO_CHANNEL or any(pint_unit(written, channel) for channel in CHANNELS)


def is_other_unit(unit: str | None, channel: str) -> bool:
    """Whether the unit that a log states outside of a name is that of another quantity."""
    stated = (unit or "").strip()
    return stated != "" and pint_unit(stated, channel) is None and is_unit_of_another(stated)


def conversion(unit: str | None, channel: str) -> tuple[float, float]:
    """Returns factor and offset from a unit in the notation of pint to that of the channel."""
    kept = unit if unit != "1" and converts(unit, channel) else None
    zero, one = in_schema_unit(np.array([0.0, 1.0]), kept, CHANNELS[channel].unit)
    return float(one - zero), float(zero)


def converts(unit: str | None, channel: str) -> bool:
    """Whether a unit is converted; a command in mA keeps its numbers."""
    return unit is not None and is_convertible(unit, CHANNELS[channel].unit)


def looks_like_a_unit(text: str) -> bool:
    """Whether a cell below a name can be a unit: "mm", "[bar]", "-" or nothing."""
    stripped = text.strip()
    bracketed = len(stripped) > 2 and stripped[0] + stripped[-1] in ("[]", "()")
    of_range = _FULL_RANGE.fullmatch(_plain(stripped)) is not None
    return bracketed or of_range or not stripped.strip("[]()") or is_unit_of_another(stripped)
