# SPDX-License-Identifier: MIT
"""Units as engineers write them: what is understood becomes the notation of `ColumnMap`.

Only the spellings listed here are understood in a log. pint alone reads too much: a rod is a length
to it, and "Mm" a megameter. What is not understood is never taken for a column without a unit.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from functools import cache
from types import MappingProxyType

import numpy as np

from ...catalogue.channels import CHANNELS, COMMAND, SUPPLY_PRESSURE
from ..layout import GAUGES, ColumnMap, in_schema_unit, is_convertible

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
_FACTOR = re.compile(
    rf"(?P<a>{_NUMBER})(?:\s*/\s*(?P<b>{_NUMBER}))?\s*\*?\s*(?P<unit>[^\W\d_].*|[%°\"‰].*)"
    rf"|(?P<whole>.*[^\W\d_])\s*/\s*(?P<c>{_NUMBER})",
    re.IGNORECASE,
)
# A number such as 1.000 may be one or one thousand.
_THOUSANDS = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")
_REFERENCE = re.compile(
    r"(?P<unit>.+?)[\s_.]*[(\[]?\s*(?:(?P<gauge>g|ga|gauge|gage|rel|relativ|relative|ü|ue|überdruck|"
    r"man|manometric)|a|abs|absolut|absolute)\.?\s*[)\]]?\.?",
    re.IGNORECASE,
)
# What may end a name without brackets, as in "position_mm"; longer words are words.
_ENDING_WORDS = """
s ms us ns min h m mm cm um in inch pa kpa mpa bar mbar psi v mv n kn mn lbf kgf t kg k c degc degf
percent pct a ma mm/s m/s cm/s
"""
_ENDINGS = frozenset(_ENDING_WORDS.split())
_BRACKETS = re.compile(
    r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*(?:\([^()]*\))?)\))\s*$"
)
_SLASH = re.compile(r"^(?P<name>.+?)\s*(?:\s/\s|\sin\s|,\s)\s*(?P<unit>\S{1,8})\s*$")
# Seconds of a unit of time.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86400.0}
# Units of a command that no rule converts into volts: the number is kept.
_OF_COMMANDS = frozenset({"mA", "A", "percent", "0.1 percent", "1"})


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
    match = _FACTOR.fullmatch(text)
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
    reference = _REFERENCE.fullmatch(text)
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


def split_unit(name: str) -> tuple[str, str | None]:
    """Returns the name without the unit in brackets or behind a slash, and the unit or None."""
    for pattern in (_BRACKETS, _SLASH):
        match = pattern.match(name)
        if match and match["name"].strip():
            groups = match.groupdict()
            unit = next((groups[key] for key in ("a", "b", "unit") if groups.get(key)), None)
            return match["name"].strip(), unit
    return name, None


def unit_shown(name: str, unit: str | None) -> str | None:
    """Returns the unit of a column that is no channel, as the log writes it; None without one."""
    stated = (unit or "").strip()
    bracket = split_unit(name)[1] or ""
    if stated or (not bracket.isdigit() and (name.endswith("]") or looks_like_a_unit(bracket))):
        return stated or bracket or None
    return None


def without_unit(name: str, channel: str) -> str:
    """Returns the name of a column without its unit; A is none in "Druck (A)"."""
    label, unit = split_unit(name)
    return name if unit is None or pint_unit(unit, channel) is None else label


def split_ending(name: str) -> tuple[str, str | None]:
    """Returns a name such as "position_mm" as ("position", "mm"); (name, None) if none ends it."""
    parts = re.split(r"[_\s]+|(?<!\d)\.", name)
    for count in (2, 1):
        ending = parts[-count:]
        if len(parts) <= count:
            continue
        for unit in (" ".join(ending), "/".join(ending)):
            reference = _REFERENCE.fullmatch(unit)
            of = reference["unit"] if reference and len(reference["unit"]) > 1 else unit
            if unit.casefold() in _ENDINGS or (of.casefold() in _ENDINGS and _is_pressure(unit)):
                return "_".join(parts[:-count]), unit
    return name, None


def _is_pressure(text: str) -> bool:
    return pint_unit(text, SUPPLY_PRESSURE) is not None


def conversion(unit: str | None, channel: str) -> tuple[float, float]:
    """Returns factor and offset from a unit in the notation of pint to that of the channel."""
    column = ColumnMap("", None if unit == "1" or not converts(unit, channel) else unit)
    zero, one = in_schema_unit(np.array([0.0, 1.0]), column, CHANNELS[channel].unit)
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
