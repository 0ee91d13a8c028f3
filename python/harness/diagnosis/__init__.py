# SPDX-License-Identifier: MIT
"""Diagnosis of why simulator and record disagree; returns typed findings, no plots or files."""

from .data.floor import noise_floor
from .decision.effect_selection import in_words
from .diagnosis import diagnose
from .excite import signals_for
from .job import STAGES
from .limits import Limits
from .model.fit import fit
from .model.parameters import calibration_parameters, effect_parameters
from .model.problem import Problem
from .next_experiment import limits_of
from .result import Diagnosis, Interim
from .search.visible import before_any_fit

__all__ = [
    "STAGES",
    "Diagnosis",
    "Interim",
    "Limits",
    "Problem",
    "before_any_fit",
    "calibration_parameters",
    "diagnose",
    "effect_parameters",
    "fit",
    "in_words",
    "limits_of",
    "noise_floor",
    "signals_for",
]
