# SPDX-License-Identifier: MIT
"""Families of wide machines: short names by which results can be grouped."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from .excitation import Excitation
from .noise import Logger
from .nominal_rig import NominalRig
from .truth import Truth


def families(
    rig: NominalRig,
    machine: Truth,
    structure: Mapping[str, float],
    logger: Logger,
    dt_s: float,
    effects: Collection[str],
    excitations: tuple[Excitation, Excitation],
) -> dict[str, str]:
    """Returns the family of a machine and its records by each trait, in a few words."""
    deviation = max(abs(structure[f"gain_{name}"] - 1.0) for name in ("pa", "at", "pb", "bt"))
    edges = "even" if deviation < 0.01 else "uneven"
    if "valve_dead_band" in effects and abs(_ends(machine)) > 0.05:
        edges = "unequal ends"
    hysteresis = "none"
    if "valve_hysteresis" in effects:
        hysteresis = "Prandtl-Ishlinskii" if machine.play_weights[0] > 0.0 else "play"
    seals = "LuGre"
    if machine.dahl_exponent > 0.0:
        seals = "Dahl"
    elif machine.bouc_wen_power > 0.0:
        seals = "Bouc-Wen"
    return {
        "rods": "double" if rig.values["cylinder.rod_m"] == 0.0 else "single",
        "flow law": _flow_law(machine.flow_exponent),
        "seals": seals,
        "supply": "relief valve" if machine.pump_flow_m3_s > 0.0 else "accumulator",
        "edges": edges,
        "hysteresis": hysteresis,
        "noise": "coloured" if logger.coloured_share > 0.3 else "nearly white",
        "timing": "late by 0.5 %" if logger.largest_late_s <= 0.005 * dt_s else "late by 2 %",
        "excitation": "+".join(sorted(excitations)),
    }


def _ends(machine: Truth) -> float:
    """Difference of the positive and the negative end of the dead band over their sum."""
    positive = machine.overlap_pa + machine.overlap_bt
    negative = machine.overlap_at + machine.overlap_pb
    return (positive - negative) / (positive + negative)


def _flow_law(exponent: float) -> str:
    if exponent < 0.51:
        return "square root"
    return "exponent to 0.525" if exponent < 0.525 else "exponent to 0.54"
