# SPDX-License-Identifier: MIT
"""Which effects can act on a user's simulator from outside, and why the others cannot.

An effect reaches a simulator through its command, its ports and its outputs. It is told from the
rig file alone, before anything runs.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from ..catalogue.parameters import effects, plain_name
from ..catalogue.spellings import ParameterKey
from ..simulators.description import FmuError, read_description
from .simulator_section import SimulatorSection

if TYPE_CHECKING:
    from .rig import Rig

# On the command: the simulator needs nothing but its command for them.
_COMMAND = """
transport_delay valve_hysteresis spool_stiction valve_lag valve_null_bias valve_flow_saturation
valve_dead_band valve_dead_band_sides flow_gain_drift
"""
# On what the simulator returns.
_OUTPUT = """
sensor_lag sensor_quantisation sensor_backlash sensor_nonlinearity position_sensor_delay
"""
_PRESSURES = "pressure_sensor_gain pressure_sensor_offset pressure_sensor_lag"
_FORCE = """
coulomb_friction coulomb_friction_sides stribeck_friction position_friction load_spring load_force
contact_spring
"""
_CHAMBERS = "internal_leakage external_leakage relief_valve makeup_check"
_SUPPLY = "supply_droop"

INSIDE = "it acts inside the simulator, where nothing from outside can act"

# Port or output -> why an effect cannot act without it.
_PORTS = (
    (_FORCE, ("force_n",), "the simulator has no input for forces"),
    (
        _CHAMBERS,
        ("flow_a_m3_s", "flow_b_m3_s"),
        "the simulator has no inputs for flows into the chambers",
    ),
    (_SUPPLY, ("supply_pressure_pa",), "the simulator has no input for the supply pressure"),
)
_OUTPUTS = (
    (
        f"{_CHAMBERS} {_PRESSURES}",
        ("pressure_a_pa", "pressure_b_pa"),
        "the simulator has no output for the chamber pressures",
    ),
    (_SUPPLY, ("supply_flow_m3_s",), "the simulator has no output for the supply flow"),
)
# Effects that are stated about a place of the stroke, or against the supply.
_VALUES = (
    ("position_friction load_spring", "cylinder.stroke_m"),
    ("relief_valve supply_droop", "supply.pressure_pa"),
)
_CARRIED = frozenset(" ".join((_COMMAND, _OUTPUT, _PRESSURES, _FORCE, _CHAMBERS, _SUPPLY)).split())


def carried(rig: Rig) -> dict[str, str | None]:
    """Returns for each effect of the catalogue None, or the reason why it cannot act from outside.

    Parameters
    ----------
    rig
        a rig with a simulator.
    """
    assert rig.simulator is not None
    return carried_by(rig.simulator, rig.values)


def carried_by(section: SimulatorSection, values: Collection[str]) -> dict[str, str | None]:
    """Returns the same for a simulator and the full names of the values that its rig file tells."""
    return {effect: _reason(effect, section, values) for effect in effects()}


def _reason(effect: str, section: SimulatorSection, values: Collection[str]) -> str | None:
    if effect not in _CARRIED:
        return INSIDE
    sides: tuple[tuple[Mapping[str, object], tuple[tuple[str, tuple[str, ...], str], ...]], ...] = (
        (section.ports, _PORTS),
        (section.outputs, _OUTPUTS),
    )
    for known, rules in sides:
        for those, needed, reason in rules:
            if effect in those.split() and not all(name in known for name in needed):
                return reason
    for those, name in _VALUES:
        if effect in those.split() and name not in values:
            return f"the rig file does not tell {name}"
    return None


def check_carried(section: SimulatorSection, values: Mapping[str, object]) -> list[str]:
    """Checks that each effect that is on can act on the simulator from outside."""
    active = {ParameterKey(name).effect for name, value in values.items() if value}
    return [
        f"'effects.{effect}': {reason}; remove it"
        for effect, reason in carried_by(section, values).items()
        if reason is not None and effect in active
    ]


def simulator_notes(rig: Rig) -> tuple[str, ...]:
    """Returns what a user should know of her simulator before it runs, in whole sentences.

    That is what its FMU asks for, and which effects cannot be judged with it. A rig without a
    simulator has no notes.
    """
    section = rig.simulator
    if section is None:
        return ()
    notes: list[str] = []
    if section.fmu is not None:
        try:
            notes += read_description(section.path).remarks
        except FmuError as error:
            notes.append(f"{section.fmu}: {error}")
    reasons: dict[str, list[str]] = {}
    for effect, reason in carried(rig).items():
        if reason is not None:
            reasons.setdefault(reason, []).append(plain_name(effect))
    notes += [f"cannot be judged: {', '.join(names)}: {why}" for why, names in reasons.items()]
    return tuple(notes)
