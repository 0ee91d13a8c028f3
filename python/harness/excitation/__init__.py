# SPDX-License-Identifier: MIT
"""Test signals for identification: arrays of the command, in its own unit."""

from ehsid.harness.excitation.chirp import chirp
from ehsid.harness.excitation.multisine import multisine, odd_multisine
from ehsid.harness.excitation.prbs import prbs
from ehsid.harness.excitation.steps import random_steps
from ehsid.harness.excitation.triangle import triangle

__all__ = ["chirp", "multisine", "odd_multisine", "prbs", "random_steps", "triangle"]
