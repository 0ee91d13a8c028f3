# SPDX-License-Identifier: MIT
"""Typical values for what an engineer does not know of her machine, each with reason and source.

A rule gives an order of magnitude and an uncertainty that admits it. Where no publication is named,
the rule is one of this project, chosen so that the usual machines lie within two deviations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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
