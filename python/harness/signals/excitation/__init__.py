# SPDX-License-Identifier: MIT
"""Test signals for identification: arrays of the command, in the unit of the command."""

from .chirp import chirp
from .excitation import Excitation
from .multisine import multisine, odd_multisine
from .named import SIGNALS, named_signal
from .prbs import prbs
from .steps import random_steps
from .travel import fit_to_travel, travel
from .triangle import triangle, triangle_length

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
    "triangle_length",
]
