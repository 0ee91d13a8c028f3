# SPDX-License-Identifier: MIT
"""Numbers with units as engineers write them, such as "63 mm", "120 bar" or "38 l/min"."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..records.layout import define_gauges, is_unit
from .checks import LARGEST_SIGMA

if TYPE_CHECKING:
    import pint

_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*")
# Spelling of engineers -> notation of pint.
_SPELLINGS = MappingProxyType(
    {"%": "percent", "µm": "um", "μm": "um", '"': "inch", "in": "inch", "lpm": "l/min",
     "gpm": "gallon/min", "to": "t", "bar(g)": "barg", "bar abs": "bar", "bara": "bar",
     "kg/s": "N*s/m", "cm³": "cm**3", "N·s/m": "N*s/m", "Ns/m": "N*s/m", "N s/m": "N*s/m",
     "kN s/m": "kN*s/m", "kNs/m": "kN*s/m"}
)  # fmt: skip
# "120 kg +- 20 %": a value and its relative 1-sigma.
_SIGMA = re.compile(r"(.*?)\s*(?:±|\+/?-)\s*(\d{1,3}(?:[.,]\d{1,3})?)\s*%\s*")
# The number of a command is kept: a record has the same number in its column.
OF_COMMANDS = ("V", "mA", "percent")
# Viscosity grades of hydraulic oils (ISO 3448), mm^2/s at 40 degrees Celsius, and how they are
# written: "46", "VG 46", "ISO VG 46", "HLP 46".
GRADES = (10, 15, 22, 32, 46, 68, 100, 150)
_GRADE = re.compile(r"\s*(?:(?:ISO|VG|HL|HLP|HVLP|HM|HV)[\s-]*)*(\d{1,4})\s*", re.IGNORECASE)


@dataclass(frozen=True)
class Quantity:
    """A quantity as given, and its value in SI units.

    Attributes
    ----------
    value
        in the unit of the rig file; for a command the number as given.
    text
        as the user would write it, with its unit.
    assumed
        whether the unit was not given, so that the usual one was taken.
    sigma
        relative 1-sigma, if the user gave one.
    """

    value: float
    text: str
    assumed: bool = False
    sigma: float | None = None


@cache
def _registry() -> pint.UnitRegistry[Any]:
    # pint is imported only where it is needed, as in records. Decimal numbers, because 35 mm are
    # 0.035 m to the last digit, and not 0.035000000000000003 m.
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(non_int_type=Decimal)
    define_gauges(registry)
    return registry


def read_quantity(text: str, option: str, usual: str, si: str) -> Quantity:
    """Returns what a text such as "63 mm" says.

    Parameters
    ----------
    text
        a number, with a decimal point or comma, and a unit; without a unit the usual one is taken.
        Behind it, "+- 20 %" may give the relative 1-sigma.
    option
        name for messages, such as "--bore".
    usual
        unit that is taken without one, such as "mm".
    si
        unit of the value, such as "m"; "command" for a rated command, whose number is kept; "grade"
        for the viscosity grade of an oil, in mm^2/s.

    Raises
    ------
    ValueError
        the text has no number, or the unit does not convert.
    """
    if si == "grade":
        return _read_grade(text, option)
    whole = text
    uncertain = _SIGMA.fullmatch(text) if len(text) <= 80 else None
    sigma = None
    if uncertain is not None:
        text, sigma = uncertain[1], float(uncertain[2].replace(",", ".")) / 100.0
        if not 0.0 < sigma <= LARGEST_SIGMA:
            raise ValueError(
                f"{option} {whole!r}: expected an uncertainty above 0 %, "
                f"{100.0 * LARGEST_SIGMA:g} % at most"
            )
    match = _NUMBER.fullmatch(text) if len(text) <= 80 else None
    example = f"'50 {usual}'"
    if match is None:
        shown = text if len(text) <= 40 else text[:37] + "..."
        raise ValueError(f"{option} {shown!r}: expected a number and its unit, such as {example}")
    number = Decimal(match[1].replace(",", "."))
    written = match[2] or usual
    unit = _SPELLINGS.get(written, written)
    if si == "command":
        if unit not in OF_COMMANDS:
            raise ValueError(
                f"{option} {text!r}: '{written}' is no unit of a command: expected V, mA or %, "
                "such as '10 V', the unit of the column command_v in the records"
            )
        value = float(number)
    else:
        if not is_unit(unit, si):
            raise ValueError(
                f"{option} {text!r}: '{written}' does not convert into {si}: expected a number "
                f"and its unit, such as {example}"
            )
        value = float(_registry().Quantity(number, unit).to(si).magnitude)
    if not math.isfinite(value):
        raise ValueError(f"{option} {text!r}: expected a finite number, such as {example}")
    return Quantity(value, f"{match[1]} {written}", assumed=not match[2], sigma=sigma)


def _read_grade(text: str, option: str) -> Quantity:
    match = _GRADE.fullmatch(text) if len(text) <= 80 else None
    if match is None or int(match[1]) not in GRADES:
        shown = text if len(text) <= 40 else text[:37] + "..."
        raise ValueError(
            f"{option} {shown!r}: expected a viscosity grade of ISO 3448, one of "
            f"{', '.join(map(str, GRADES))}, such as 'VG 46'"
        )
    return Quantity(float(match[1]), f"ISO VG {match[1]}")
