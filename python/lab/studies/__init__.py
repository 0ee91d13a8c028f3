# SPDX-License-Identifier: MIT
"""Repeats the published experiment: its figures, its model as a known plant, the comparison."""

from .comparison import Contender, KnownPlant, Outcome, Setting, compare
from .rig_records import MODEL_16

__all__ = [
    "MODEL_16",
    "Contender",
    "KnownPlant",
    "Outcome",
    "Setting",
    "compare",
]
