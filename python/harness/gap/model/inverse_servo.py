# SPDX-License-Identifier: MIT
"""Terms of all equations of a servo in weak form, from the measured signals of a record.

Positions and pressures are those of the record. Only the command path of the valve is simulated,
and the supply pressure where it is not measured.
"""

from __future__ import annotations

import math

import numpy as np

from ehsid.harness.gap.model.inverse_chambers import continuities, supply_and_flows, supply_line
from ehsid.harness.gap.model.inverse_motion import axis_force, cylinder_force
from ehsid.harness.gap.model.inverse_signals import Measured, Terms, Values
from ehsid.harness.gap.model.inverse_valve import opening_of, spool_of
from ehsid.harness.gap.model.weak_form import WeakForm
from ehsid.harness.gap.thresholds import SKIP_S

SPOOL = "spool"
CAP = "valve and cap-side continuity"
ROD = "valve and rod-side continuity"
SUPPLY = "supply line"
FORCE = "force balance"

# The pressure in a chamber does not fall to vacuum. Sensor noise near vacuum may show less.
LOWEST_PA = 1e3


def servo_terms(signals: Measured, values: Values, plant: str) -> dict[str, Terms]:
    """Returns the terms of the equations for which the record has measurements, by equation.

    Parameters
    ----------
    signals
        measured signals of a record.
    values
        all values of the plant by full name, see `all_values`.
    plant
        "ehs" or "axis"; other plants have no equations here.
    """
    weak = WeakForm(signals.dt_s, first=math.ceil(SKIP_S / signals.dt_s))
    if plant == "axis":
        return {FORCE: axis_force(signals, values, weak)}
    if plant != "ehs":
        return {}
    terms: dict[str, Terms] = {}
    spool = spool_of(signals, values)
    if "spool" in signals.columns:
        terms[SPOOL] = {
            "spool": weak.mean(signals.columns["spool"]),
            "command": -weak.mean(spool),
        }
        spool = signals.columns["spool"]
    if not {"pressure_a_pa", "pressure_b_pa"} <= signals.columns.keys():
        return terms
    pressure_a = np.maximum(signals.columns["pressure_a_pa"], LOWEST_PA)
    pressure_b = np.maximum(signals.columns["pressure_b_pa"], LOWEST_PA)
    opening = opening_of(spool, values)
    supply, flows = supply_and_flows(signals, opening, pressure_a, pressure_b, values)
    if "supply_pressure_pa" in signals.columns:
        terms[SUPPLY] = supply_line(signals, supply, flows, values, weak)
    terms[CAP], terms[ROD] = continuities(signals, flows, pressure_a, pressure_b, values, weak)
    terms[FORCE] = cylinder_force(signals, pressure_a, pressure_b, values, weak)
    return terms
