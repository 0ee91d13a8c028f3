# SPDX-License-Identifier: MIT
"""Test signals by name, as options have them."""

from __future__ import annotations

from enum import StrEnum


class SignalName(StrEnum):
    """Test signals."""

    multisine = "multisine"
    prbs = "prbs"
    steps = "steps"
    chirp = "chirp"
    triangle = "triangle"
