# SPDX-License-Identifier: MIT
"""Test signals for identification: arrays of the command, in the unit of the command."""

from ehsid.harness.excitation.chirp import chirp
from ehsid.harness.excitation.excitation import Excitation
from ehsid.harness.excitation.multisine import multisine, odd_multisine
from ehsid.harness.excitation.named import SIGNALS, named_signal
from ehsid.harness.excitation.prbs import prbs
from ehsid.harness.excitation.steps import random_steps
from ehsid.harness.excitation.travel import fit_to_travel, travel
from ehsid.harness.excitation.triangle import triangle, triangle_length

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
