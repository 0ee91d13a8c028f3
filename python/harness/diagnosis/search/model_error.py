# SPDX-License-Identifier: MIT
"""By how much found values of a rig differ from the true ones because no simulator is exact.

A fit finds the value with which the simulator follows the machine best. What the simulator lacks
moves it, and the scatter over windows does not tell by how much.

Seals have friction of up to SEALS of the largest force (`EffectInfo.least_size` of Coulomb
friction). Where no law of friction is fitted, viscous friction d v stands in for it. The least
squares of F sgn(v) by d v over the records give

    d = F mean |v| / mean v^2

so that a slow motion hardly shows the viscous friction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.families import friction_laws
from ...catalogue.spellings import ParameterKey
from ...records import Record
from ..model.case import Case
from ..model.scale import machine_scale

# Relative deviation of a value, made by a simulator with other metering edges, seals and oil
# although it reaches the floor: with measured pressures, and with the position alone. On
# development records of an independent generator, nine intervals in ten held the truth with these
# values, five in ten without.
MODEL_ERROR = {True: 0.015, False: 0.025}
# The same of values that stand for more than one thing: the bulk modulus also for gas in the oil
# and for hoses, the lag of a configured valve also for the limit of its speed and the friction of
# its spool. Set on 45 generated machines (seed 74025), of which two intervals in three held the
# truth without.
OF_VALUE = {
    "fluid.bulk_modulus_pa": {True: 0.03, False: 0.05},
    "effects.valve_lag.bandwidth_hz": {True: 0.12, False: 0.12},
    "effects.valve_lag.damping": {True: 0.05, False: 0.06},
}
VISCOUS = "load.viscous_friction_n_s_m"
# Friction of seals, share of the largest force; and the deviation of what viscous friction takes of
# it, as a share of what it could take at most: set on the same machines.
SEALS, TAKEN = 0.003, 0.25
# A speed is the way in this time, s: of a shorter one the noise of the sensor would be a part.
SPEED_S = 0.02


def model_error(case: Case, effects: Sequence[str], name: str, value: float) -> float:
    """Returns the relative standard deviation of a value that the simulator causes.

    Parameters
    ----------
    case
        rig and records.
    effects
        effects that were fitted with the value.
    name, value
        full name of the value, and what was found.
    """
    if name in OF_VALUE and ParameterKey(name).effect not in effects:
        return OF_VALUE[name][case.pressures]
    error = MODEL_ERROR[case.pressures]
    if name == VISCOUS and value > 0.0 and not friction_laws() & set(effects):
        return float(np.hypot(error, TAKEN * seal_friction(case) / value))
    return error


def seal_friction(case: Case) -> float:
    """Largest viscous friction, N s/m, for which the friction of seals can be taken.

    It is infinite where the rod rests in all records.
    """
    speeds = np.concatenate([_speeds(record) for record in case.records])
    square = float(np.mean(speeds**2))
    # d = F mean |v| / mean v^2
    force_n = SEALS * machine_scale(case.rig).force_n
    return force_n * float(np.mean(np.abs(speeds))) / square if square > 0.0 else np.inf


def _speeds(record: Record) -> FloatArray:
    assert record.dt_s is not None
    samples = max(1, round(SPEED_S / record.dt_s))
    position = record.column("position_m")
    return np.asarray((position[samples:] - position[:-samples]) / (samples * record.dt_s))
