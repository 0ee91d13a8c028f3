# SPDX-License-Identifier: MIT
"""Whether the metering edges of the valve, which no pressure shows, can stand for a load force."""

from __future__ import annotations

from ...catalogue.keys import ParameterKey
from ..deciding import FORCE_DEVIATIONS
from ..model.case import Case
from .candidates import FittedCandidate
from .families import spelled_out
from .intervals import candidate_deviations

FORCE = "load_force"


def edges_can_replace_force(case: Case, candidate: FittedCandidate) -> bool:
    """Whether unequal edges of the valve can explain the load force of a candidate.

    They can where no pressure is measured and the force is small beside its standard deviation. A
    force that is a part of another effect has no deviation of its own: there the set in which it is
    spelled out stands for the effect.
    """
    if case.pressures or case.rig.plant != "ehs" or FORCE not in spelled_out(candidate.effects):
        return False
    if FORCE not in candidate.effects:
        return True
    names = [parameter.name for parameter in case.parameters(candidate.effects)]
    index = names.index(ParameterKey.of_effect(FORCE, "force_n"))
    deviations, _ = candidate_deviations(case, candidate)
    return abs(float(candidate.x[index])) < FORCE_DEVIATIONS * float(deviations[index])
