# SPDX-License-Identifier: MIT
"""Why simulator and record disagree: rooms of the diagnosis. Typed findings, no plots, no files."""

from ehsid.harness.gap.comparison import Compared, GapFigure, gap_figure
from ehsid.harness.gap.diagnose import diagnose
from ehsid.harness.gap.findings import Diagnosis
from ehsid.harness.gap.fit import Fit, fit
from ehsid.harness.gap.floor import NoiseFloor, noise_floor
from ehsid.harness.gap.parameters import Parameter, calibration_parameters, effect_parameters
from ehsid.harness.gap.problem import Problem

__all__ = [
    "Compared",
    "Diagnosis",
    "Fit",
    "GapFigure",
    "NoiseFloor",
    "Parameter",
    "Problem",
    "calibration_parameters",
    "diagnose",
    "effect_parameters",
    "fit",
    "gap_figure",
    "noise_floor",
]
