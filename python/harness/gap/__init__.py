# SPDX-License-Identifier: MIT
"""Diagnosis of why simulator and record disagree; returns typed findings, no plots or files."""

from ehsid.harness.gap.data.floor import NoiseFloor, noise_floor
from ehsid.harness.gap.diagnosis import diagnose
from ehsid.harness.gap.inference.words import in_words
from ehsid.harness.gap.interim import STAGES
from ehsid.harness.gap.model.comparison import Compared, GapFigure, gap_figure
from ehsid.harness.gap.model.fit import Fit, fit
from ehsid.harness.gap.model.parameters import Parameter, calibration_parameters, effect_parameters
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.schema import Diagnosis, Interim

__all__ = [
    "STAGES",
    "Compared",
    "Diagnosis",
    "Fit",
    "GapFigure",
    "Interim",
    "NoiseFloor",
    "Parameter",
    "Problem",
    "calibration_parameters",
    "diagnose",
    "effect_parameters",
    "fit",
    "gap_figure",
    "in_words",
    "noise_floor",
]
