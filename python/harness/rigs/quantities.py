# SPDX-License-Identifier: MIT
"""Numbers with units as engineers write them, such as "63 mm", "120 bar" or "38 l/min".

Typical values for what an engineer does not know of her machine, each with reason and source.

A rule gives an order of magnitude and an uncertainty that admits it. Where no publication is named,
the rule is one of this project, chosen so that the usual machines lie within two deviations.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from types import MappingProxyType

from ..records.units import is_unit, unit_registry
from .checks import LARGEST_SIGMA

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
    """A quantity as given, and its value in SI units."""

    value: float
    """In the unit of the rig file; for a command the number as given."""
    text: str
    """As the user would write it, with its unit."""
    assumed: bool = False
    """Whether the unit was not given, so that the usual one was taken."""
    sigma: float | None = None
    """Relative 1-sigma, if the user gave one."""


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
        # Decimal numbers: 35 mm are 0.035 m to the last digit, and not 0.035000000000000003 m.
        value = float(unit_registry(Decimal).Quantity(number, unit).to(si).magnitude)
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


BAR = 1e5
USUAL_GRADE = 46.0  # ISO viscosity grade of most power units, mm^2/s


@dataclass(frozen=True)
class Typical:
    """A typical value in SI units, its relative 1-sigma, and the reason with the source."""

    value: float
    sigma: float
    why: str


def dead_volume(swept_m3: float) -> Typical:
    """Volume of a chamber and its line at the end of the stroke, from the swept volume, m^3."""
    return Typical(
        0.2 * swept_m3,
        0.5,
        "20 % of the swept volume: ports, manifold and a short line; long hoses have more. Rule of "
        "this project",
    )


def port_volume(swept_m3: float) -> float:
    """Volume of ports and clearance without any line, m^3: 5 % of the swept volume."""
    return 0.05 * swept_m3


def bulk_modulus(hoses: bool) -> Typical:
    """Effective bulk modulus of oil, some air and the walls around it, Pa."""
    if hoses:
        return Typical(
            0.7e9,
            0.3,
            "effective value with hoses: 0.5 to 0.9 GPa; Merritt (Hydraulic Control Systems, Wiley "
            "1967, ch. 1) takes 0.7 GPa, 100 000 psi, where nothing is known",
        )
    return Typical(
        1.0e9,
        0.3,
        "effective value with walls and pipes: 0.7 to 1.4 GPa, between that of usual machines and "
        "that of the oil alone (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 1)",
    )


def load_mass(stiffness_n_m: float) -> Typical:
    """Moved mass from the stiffness of the oil at mid-stroke, N/m: a guess, hardly more."""
    hz = 40.0
    return Typical(
        stiffness_n_m / (2.0 * math.pi * hz) ** 2,
        2.0,
        f"not known: the mass that makes the oil spring ring at {hz:g} Hz; servo axes ring between "
        "10 and 150 Hz. Rule of this project",
    )


def viscous_friction(force_n: float, speed_m_s: float, grade: float | None) -> Typical:
    """Viscous friction, N s/m, from the force of the piston, N, and the largest speed, m/s.

    `grade` is the viscosity grade of the oil, mm^2/s, with which this friction goes; None: unknown.
    """
    of_oil = "" if grade is None else f", times {grade:g} / {USUAL_GRADE:g} for the oil"
    return Typical(
        0.02 * force_n / speed_m_s * (grade or USUAL_GRADE) / USUAL_GRADE,
        1.0,
        f"2 % of the piston's force at full speed{of_oil}; makers of cylinders give efficiencies "
        "of 0.9 to 0.98, and most of the loss is dry friction. Rule of this project",
    )


def accumulator_capacitance(volume_m3: float, precharge_pa: float, supply_pa: float) -> Typical:
    """Volume that an accumulator takes per pressure at the supply pressure, m^3/Pa.

    The gas fills V = V_0 p_0 / p after it has been charged slowly, at one temperature. Fast, it
    follows p V^n with n between 1 and 1.4 (nitrogen): C = V / (n p).
    """
    exponent = 1.2
    gas_m3 = volume_m3 * precharge_pa / supply_pa
    return Typical(
        gas_m3 / (exponent * supply_pa),
        0.2,
        "gas law with an exponent of 1.2, between that of slow changes (1) and fast ones (1.4)",
    )


def source_resistance(supply_pa: float, flow_m3_s: float) -> Typical:
    """Pressure lost between pump and accumulator over flow, Pa s/m^3."""
    return Typical(
        0.05 * supply_pa / flow_m3_s,
        1.0,
        "5 % of the supply pressure at the rated flow: pump, line and filter. Rule of this project",
    )


def axis_friction(mass_kg: float) -> Typical:
    """Viscous friction of a motor-driven axis, N s/m, from its mass, kg."""
    return Typical(
        2.0 * mass_kg, 1.0, "a time constant of 0.5 s for a free axis. Rule of this project"
    )


def tank_pressure() -> Typical:
    """Absolute pressure of the return line, Pa."""
    return Typical(2.0 * BAR, 0.5, "1 bar of the atmosphere and 1 bar in return line and filter")


def rated_drop() -> Typical:
    """Pressure drop of one edge at which valves are rated, Pa."""
    return Typical(
        35.0 * BAR,
        0.001,
        "servo valves are usually rated at 70 bar over both edges, 35 bar over one. For a "
        "proportional valve that is rated at 10 bar over both, give --rated-drop '5 bar'",
    )


def rated_command() -> Typical:
    """Command at full opening, V."""
    return Typical(10.0, 0.001, "most amplifiers take -10 to 10 V")


def valve_bandwidth(flow_m3_s: float, drop_pa: float) -> Typical:
    """Bandwidth of the spool at -90 degrees, Hz, from the rated flow and its drop."""
    litres = 6e4 * flow_m3_s * math.sqrt(35.0 * BAR / drop_pa)
    hz = 80.0 if litres < 50.0 else 50.0 if litres < 120.0 else 30.0
    return Typical(
        hz,
        0.5,
        f"a direct-driven or two-stage valve of {litres:.0f} l/min at 35 bar over an edge; larger "
        "valves are slower: 80 Hz below 50 l/min, 50 Hz below 120 l/min, 30 Hz above. Rule of this "
        "project",
    )


def valve_damping() -> Typical:
    """Damping of the spool."""
    return Typical(0.9, 0.3, "valves are tuned to hardly any overshoot: 0.7 to 1.1")


def position_noise(stroke_m: float) -> float:
    """Standard deviation of the position, m: 30 ppm of the stroke, or 5 um where that is more."""
    return max(3e-5 * stroke_m, 5e-6)


def pressure_noise(supply_pa: float) -> float:
    """Standard deviation of a pressure, Pa: 0.1 % of the supply."""
    return 1e-3 * supply_pa


VELOCITY_NOISE_M_S = 1e-3
SPOOL_NOISE = 1e-3
