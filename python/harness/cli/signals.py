# SPDX-License-Identifier: MIT
"""Names of the test signals on the command line."""

from __future__ import annotations

from enum import StrEnum


class SignalName(StrEnum):
    """Names of the test signals."""

    multisine = "multisine"
    prbs = "prbs"
    steps = "steps"
    chirp = "chirp"
    triangle = "triangle"
