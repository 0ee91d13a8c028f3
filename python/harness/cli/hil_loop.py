# SPDX-License-Identifier: MIT
"""Values of the option `--loop` of `ehsid hil`."""

from __future__ import annotations

from enum import StrEnum


class HilLoop(StrEnum):
    """Kind of run: the published experiment, an open loop, or position control on the target."""

    experiment = "experiment"
    open = "open"
    position = "position"
