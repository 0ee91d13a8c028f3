# SPDX-License-Identifier: MIT
"""Test signals for identification: arrays of the command, in the unit of the command."""

from .excitation import Excitation, fit_to_travel, multisine, odd_multisine, travel
from .shapes import SIGNALS, chirp, named_signal, prbs, random_steps, triangle

__all__ = [
    "SIGNALS",
    "Excitation",
    "chirp",
    "fit_to_travel",
    "multisine",
    "named_signal",
    "odd_multisine",
    "prbs",
    "random_steps",
    "travel",
    "triangle",
]
