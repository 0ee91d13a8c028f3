# SPDX-License-Identifier: MIT
"""What `ehsid hil` runs, as its option has it."""

from __future__ import annotations

from enum import StrEnum


class HilLoop(StrEnum):
    """What runs."""

    experiment = "experiment"
    open = "open"
    position = "position"
